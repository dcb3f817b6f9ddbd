"""`wsm` as a person meets it: exit codes, one message instead of a traceback, options, help."""

import errno
import json
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest
from fake_runs import environment
from typer.testing import CliRunner

from pipelines.cli import app


@pytest.fixture(scope="module")
def server():
    """Starts `wsm` with the fake stages in processes of their own, without importing it for each anew."""
    command = [sys.executable, "-m", "fake_wsm", "--serve"]
    with subprocess.Popen(
        command, env=environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process
        process.stdin.close()


@pytest.fixture
def wsm(tmp_path, source, server):
    """Runs `wsm` with the fake stages."""

    def run(*words):
        server.stdin.write(json.dumps([str(tmp_path), *map(str, words)]) + "\n")
        server.stdin.flush()
        code = int(server.stdout.readline())
        said = ((tmp_path / name).read_text() for name in ("stdout", "stderr"))
        return subprocess.CompletedProcess(words, code, *said)

    return run


COPY = ("copy", "--set", "source=source", "--out", "out", "--quiet", "--workers", "1")


def test_a_stage_runs_and_prints_its_table(wsm, tmp_path):
    done = wsm(*COPY)
    assert (done.returncode, done.stderr) == (0, "")
    header, row = done.stdout.splitlines()
    assert header.split()[:4] == ["stage", "units", "ran", "done"]
    assert row.split()[:4] == ["copy", "3", "3", "3"]
    assert (tmp_path / "out" / "copies" / "a1.txt").read_text() == "text of a1"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--set", "lettres=upper"), "error: unknown key lettres; did you mean letters?\n"),
        (("--set", "repeat"), "error: --set takes key=value or section.key=value, found 'repeat'\n"),
        (("--set", "letters=odd"), "error: letters must be one of as_they_are, upper, found 'odd'\n"),
        (("--out", "s3://bucket/out"), "error: --out must be a path on this machine, found the URL s3://bucket/out;"),
        (("--set", "source=s3://b/t"), "error: source must be a path on this machine, found the URL s3://b/t;"),
        (("--config", "absent.toml"), "error: configuration file absent.toml does not exist\n"),
    ],
)
def test_a_wrong_request_is_one_line_and_exit_code_2(wsm, tmp_path, words, said):
    done = wsm(*COPY, *words)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith(said)
    assert not (tmp_path / "out").exists()


def test_too_many_refusals_are_exit_code_3(wsm, source):
    (source / "a1.txt").write_text("bad")
    done = wsm(*COPY)
    assert done.returncode == 3
    assert done.stderr.startswith("error: copy: 1 of 3 units were refused, more than --max-refused 0.1 allows")
    assert done.stderr.count("\n") == 1
    assert wsm(*COPY, "--max-refused", 1).returncode == 0


def test_damage_is_exit_code_4(wsm, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "stage.json").write_text("{")
    done = wsm(*COPY)
    assert done.returncode == 4
    assert done.stderr.startswith("error: out/stage.json is not a stage record")


def test_a_full_disk_is_a_message_and_exit_code_1(wsm, source):
    (source / "a1.txt").write_text("disk full")
    done = wsm(*COPY)
    assert done.returncode == 1
    assert done.stderr.startswith("error: the disk of out is full")
    assert "Traceback" not in done.stderr


def test_a_place_that_cannot_be_used_is_a_message_and_another_error_of_the_system_is_not(monkeypatch):
    raised = [PermissionError(errno.EACCES, "Permission denied", "far/clip.png"), OSError(errno.EBADF, "no file", "x")]

    def refuse(*_):
        raise raised.pop(0)

    monkeypatch.setattr("pipelines.operations.status.show_status", refuse)
    told = CliRunner().invoke(app, ["status", "."])
    assert told.exit_code == 1
    assert told.stderr.startswith("error: far/clip.png cannot be used (Permission denied)")
    assert isinstance(CliRunner().invoke(app, ["status", "."]).exception, OSError)


def test_a_bug_keeps_its_traceback(wsm, source):
    (source / "a1.txt").write_text("bug")
    done = wsm(*COPY)
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert done.stderr.endswith("ValueError: a bug in a1\n")


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_is_a_message_and_exit_code_130_and_the_run_goes_on_later(wsm, tmp_path, fakes_on_path, source, workers):
    words = (*COPY[:-1], workers)
    command = [sys.executable, "-m", "fake_wsm", *words, "--set", "pause_s=0.5"]
    with subprocess.Popen(command, env=fakes_on_path, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as child:
        ledger = tmp_path / "out" / "ledger.jsonl"
        while not (ledger.exists() and ledger.read_bytes().endswith(b"\n")):
            assert child.poll() is None
            time.sleep(0.02)
        child.send_signal(signal.SIGINT)
        _, said = child.communicate(timeout=300)
    assert child.returncode == 130
    assert said == "error: interrupted; run the same command again to go on where it stopped\n"
    done = wsm(*words)
    assert done.returncode == 0
    assert int(done.stdout.splitlines()[1].split()[2]) < 3  # what had been done was not done again


def test_a_dry_run_shows_settings_and_units_and_writes_nothing(wsm, tmp_path):
    done = wsm(*COPY, "--dry-run", "--limit", "2")
    assert done.returncode == 0
    settings, rest = done.stdout.removeprefix("copy: settings\n").split("\n}\n")
    assert json.loads(settings + "}")["letters"] == "as_they_are"
    assert rest.splitlines()[:2] == ["copy: would do a1", "copy: would do a2"]
    assert not (tmp_path / "out").exists()


def test_an_unknown_engine_is_refused_with_the_known_ones(wsm):
    done = wsm(*COPY, "--engine", "spark")
    assert done.returncode == 2
    assert "'local', 'ray', 'slurm'" in " ".join(done.stderr.split())


def test_settings_come_from_the_stages_section_of_a_file_and_set_wins(wsm, tmp_path):
    (tmp_path / "my.toml").write_text('[copy]\nletters = "upper"\nrepeat = 3\n[join]\n')
    assert wsm(*COPY, "--config", "my.toml", "--set", "repeat=2").returncode == 0
    assert (tmp_path / "out" / "copies" / "a1.txt").read_text() == "TEXT OF A1" * 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[coppy]\nrepeat = 2", "error: my.toml: 'coppy' is not known; did you mean copy?\n"),
        ("copy = 2", "error: my.toml: copy is a section of settings, found the value 2\n"),
        ("[copy]\nrepaet = 2", "error: unknown key repaet; did you mean repeat?\n"),
    ],
)
def test_no_key_of_a_file_is_quietly_ignored(wsm, tmp_path, text, said):
    (tmp_path / "my.toml").write_text(text)
    done = wsm(*COPY, "--config", "my.toml")
    assert (done.returncode, done.stderr) == (2, said)


def test_help_lists_every_stage_and_a_stage_lists_every_option():
    def help_of(*words):
        program = "from pipelines.cli import app; app(prog_name='wsm')"
        command = [sys.executable, "-c", program, *words, "--help"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    from pipelines.registry import STAGES

    assert {entry.name for entry in STAGES} <= set(help_of().split())
    options = ("--config", "--set", "--out", "--workers", "--engine", "--limit", "--only", "--dry-run", "--max-refused")
    for name in ("index", "run", "demo"):
        assert set(options) <= set(help_of(name).replace(",", " ").split())


def test_the_version_is_that_of_the_project(wsm):
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert wsm("--version").stdout == f"wsm {project['version']}\n"
