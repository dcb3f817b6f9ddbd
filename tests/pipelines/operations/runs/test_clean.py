"""`wsm clean`: says what it would delete, deletes what is vouched for elsewhere, and loses nothing."""

import os
import signal
from itertools import count

import pytest
import typer
from fake_runs import ANY, copies
from fake_stages import COPY, CopyConfig

from pipelines.operations.runs.clean import clean
from pipelines.running.runner import run_stage
from wsm_data.errors import ConfigError, IntegrityError

BYTES = 3 * len("text of a1")


@pytest.fixture
def folder(run, tmp_path):
    """A finished run."""
    run()
    return tmp_path / "run"


def test_a_dry_run_says_the_bytes_and_deletes_nothing(folder, capsys):
    clean(folder, dry_run=True, yes=False)
    assert capsys.readouterr().out.splitlines()[-1].split()[-2:] == ["3", str(BYTES)]
    assert len(copies(folder / "copy")) == 3


def test_it_asks_and_deletes_nothing_without_a_yes(folder, monkeypatch):
    asked = []
    monkeypatch.setattr(typer, "confirm", lambda text: bool(asked.append(text)))
    clean(folder, dry_run=False, yes=False)
    assert asked == [f"delete {BYTES} bytes?"]
    assert len(copies(folder / "copy")) == 3


def test_what_is_deleted_stays_done_and_comes_back_where_it_is_needed(folder, run, capsys):
    clean(folder, dry_run=False, yes=True)
    assert f"{BYTES} bytes were freed" in capsys.readouterr().out
    assert copies(folder / "copy") == {}
    assert run() == []
    (folder / "join" / "a1").write_text("text of A1!")  # as long as before: found by its digest
    os.utime(folder / "join" / "a1")
    assert run() == ["a1", "finish"]
    assert (folder / "join" / "a1").read_text() == "text of a1!"
    assert copies(folder / "copy") == {"a1": "text of a1"}


def test_damaged_files_that_were_set_aside_go_too(folder):
    (folder / "copy" / "copies" / "a1.txt.damaged").write_text("x" * 7)
    clean(folder, dry_run=False, yes=True)
    assert not list(folder.rglob("*.damaged"))


def test_nothing_is_deleted_where_the_other_copy_is_not_what_was_written(folder):
    (folder / "join" / "b1").write_text("text of B1!")
    with pytest.raises(IntegrityError, match="nothing was deleted"):
        clean(folder, dry_run=False, yes=True)
    assert len(copies(folder / "copy")) == 3


def test_an_unfinished_run_is_refused(run, source, tmp_path):
    run(only=("a*",))
    folder = tmp_path / "run"
    clean(folder, dry_run=False, yes=True)  # what is packed of a part can be made again
    assert run() == ["b1", "finish"]
    (source / "b1.txt").write_text("another text")
    run_copy_only(source, folder)
    with pytest.raises(ConfigError, match="is older than its input"):
        clean(folder, dry_run=True, yes=False)


def run_copy_only(source, folder):
    run_stage(COPY, CopyConfig(source=source), folder / "copy", ANY)


def test_a_folder_of_no_run_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="must be the folder of a run"):
        clean(tmp_path, dry_run=True, yes=False)


def clean_and_die(folder, at):
    """Whether a clean in a process of its own was killed before its `at`-th step to the disk."""
    child = os.fork()
    if not child:
        left = iter(range(1, at))

        def dying(step):
            def before(*args, **kwargs):
                if next(left, None) is None:
                    os.kill(os.getpid(), signal.SIGKILL)
                return step(*args, **kwargs)

            return before

        os.fsync, os.unlink = dying(os.fsync), dying(os.unlink)
        clean(folder, dry_run=False, yes=True)
        os._exit(0)
    return os.waitpid(child, 0)[1] != 0


def test_killed_before_any_step_to_the_disk_it_loses_no_work(folder, run):
    deaths = 0
    for at in count(1):
        died = clean_and_die(folder, at)
        assert run() == []  # nothing is done again, whatever is deleted by now
        deaths += died
        if not died:
            break
    assert deaths >= 3  # each goes further than the one before, which has left less to do
    assert copies(folder / "copy") == {}
