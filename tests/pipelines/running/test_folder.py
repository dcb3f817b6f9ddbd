"""A stage's folder: its record, and one writer at a time."""

import json
import subprocess
import sys

import pytest

from pipelines.running.folder import StageRecord, locked, read_stage_record, write_stage_record
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.sealed import sealed

RECORD = StageRecord(
    name="copy",
    version=3,
    settings={"a": 1},
    config={"a": 1, "source": "tree"},
    fingerprint="f" * 8,
    inputs={"index": "1"},
    seen={"index": "2"},
    units=4,
    workers=2,
)


def test_a_folder_without_a_record_was_written_by_no_stage(tmp_path):
    assert read_stage_record(tmp_path) is None


def test_a_record_is_read_back(tmp_path):
    write_stage_record(tmp_path, RECORD)
    assert read_stage_record(tmp_path) == RECORD


@pytest.mark.parametrize("text", ["", "{", "{}", "[1]", '{"name": "copy", "what": 1}'])
def test_a_record_that_cannot_be_read_is_damage(tmp_path, text):
    (tmp_path / "stage.json").write_text(text)
    with pytest.raises(IntegrityError, match="is not a stage record"):
        read_stage_record(tmp_path)


@pytest.mark.parametrize("change", [{"version": "3"}, {"outputs": {"kept": 1}}, {"inputs": {"index": 1}}])
def test_a_record_of_other_types_is_damage(tmp_path, change):
    write_text(tmp_path / "stage.json", json.dumps(sealed(vars(RECORD) | change)))
    with pytest.raises(IntegrityError, match=f"is not a stage record .*{next(iter(change))}"):
        read_stage_record(tmp_path)


# the lock

HOLDER = (
    "import sys; from pathlib import Path; from pipelines.running.folder import locked\n"
    "with locked(Path(sys.argv[1])):\n    print('held', flush=True)\n    sys.stdin.read()"
)


@pytest.fixture
def holder(tmp_path):
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_a_second_writer_is_refused(tmp_path, holder):
    with pytest.raises(ConfigError, match="is being written by another wsm process"), locked(tmp_path):
        pass


def test_the_lock_of_a_killed_process_falls(tmp_path, holder):
    holder.kill()
    holder.wait()
    with locked(tmp_path), pytest.raises(ConfigError), locked(tmp_path):
        pass  # it is held anew


def test_the_lock_falls_with_an_error(tmp_path):
    with pytest.raises(KeyError), locked(tmp_path):
        raise KeyError
    with locked(tmp_path):
        pass


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_a_folder_that_cannot_be_is_a_wrong_request(tmp_path, out):
    (tmp_path / "file").write_text("here already")
    with (
        pytest.raises(ConfigError, match=r"must be a folder that can be written .*; use another"),
        locked(tmp_path / out),
    ):
        pass
    assert (tmp_path / "file").read_text() == "here already"


def test_the_lock_file_is_empty_and_the_same_in_every_folder(tmp_path):
    with locked(tmp_path):
        pass
    assert (tmp_path / ".lock").read_bytes() == b""
