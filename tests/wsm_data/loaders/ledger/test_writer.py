import errno
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.loaders.ledger.files import ledger_files, read_ledger_file
from wsm_data.loaders.ledger.writer import LedgerWriter

NONE = np.empty(0, np.int64)


def test_nothing_is_written_before_the_first_start(tmp_path):
    with LedgerWriter(tmp_path / "ledger", {}, 0, 1):
        pass
    assert not (tmp_path / "ledger").exists()


def test_every_process_of_a_rank_has_a_file_of_its_own(tmp_path):
    for rank in (0, 1, 0):
        with LedgerWriter(tmp_path, {}, rank, 2) as writer:
            writer.begin(0, 0, 1)
    assert list(ledger_files(tmp_path)) == [(0, 0), (0, 1), (1, 0)]
    assert len({read_ledger_file(path).session for path in ledger_files(tmp_path).values()}) == 3


def test_a_start_after_close_opens_another_file(tmp_path):
    writer = LedgerWriter(tmp_path, {}, 0, 1)
    for _ in range(2):
        writer.begin(0, 0, 1)
        writer.close()
        writer.close()
    assert list(ledger_files(tmp_path)) == [(0, 0), (0, 1)]


def test_a_ledger_of_another_run_is_refused_with_both_identities(tmp_path):
    with LedgerWriter(tmp_path, {"seed": 1, "sources": (2, 3)}, 0, 1) as writer:
        writer.begin(0, 0, 1)
    LedgerWriter(tmp_path, {"sources": [2, 3], "seed": 1}, 0, 4)  # the same as JSON, on another world size
    with pytest.raises(ConfigError, match=r"(?s)  seed: 1 -> 2\nGive each run a ledger of its own"):
        LedgerWriter(tmp_path, {"seed": 2, "sources": [2, 3]}, 0, 1)


@pytest.mark.parametrize(
    ("epoch", "step"), [(0, 0), (0, 2), (1, 1), (-1, 1)], ids=["again", "left out", "not begun", "no epoch"]
)
def test_a_step_that_is_not_the_next_is_a_bug_of_the_caller(tmp_path, epoch, step):
    with LedgerWriter(tmp_path, {}, 0, 1) as writer:
        writer.begin(0, 0, 3)
        writer.record(0, 0, NONE)
        with pytest.raises(ValueError, match="the next step must be 1 of 3 in epoch 0"):
            writer.record(epoch, step, NONE)


def test_no_step_comes_after_the_last_or_before_the_first_start_or_after_the_end(tmp_path):
    writer = LedgerWriter(tmp_path, {}, 0, 1)
    with pytest.raises(ValueError, match="begin"):
        writer.record(0, 0, NONE)
    writer.begin(0, 1, 1)
    with pytest.raises(ValueError, match="the next step must be 1 of 1"):
        writer.record(0, 1, NONE)
    writer.close()
    with pytest.raises(ValueError, match="begin"):
        writer.record(0, 1, NONE)


@pytest.mark.parametrize("start", [(-1, 0, 3), (0, -1, 3), (0, 4, 3)])
def test_a_start_outside_its_epoch_is_a_bug_of_the_caller(tmp_path, start):
    with pytest.raises(ValueError, match="a start must be a step"):
        LedgerWriter(tmp_path, {}, 0, 1).begin(*start)


@pytest.mark.parametrize("rank", [-1, 2])
def test_a_rank_must_exist(tmp_path, rank):
    with pytest.raises(ValueError, match="rank must lie in"):
        LedgerWriter(tmp_path, {}, rank, 2)


def test_what_was_recorded_survives_a_kill(tmp_path):
    program = f"""
import os, signal
import numpy as np
from wsm_data.loaders.ledger.writer import LedgerWriter
writer = LedgerWriter({str(tmp_path)!r}, {{}}, 0, 1)
writer.begin(0, 0, 100)
for step in range(7):
    writer.record(0, step, np.array([step]))
os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, "-c", program], timeout=300).returncode == -signal.SIGKILL
    file = read_ledger_file(tmp_path / "rank-00000.jsonl")
    assert [refs.tolist() for refs in file.segments[0].refs] == [[step] for step in range(7)]
    assert not file.closed


def test_a_record_that_is_cut_short_stops_the_run(tmp_path, monkeypatch):
    writer = LedgerWriter(tmp_path, {}, 0, 1)
    writer.begin(0, 0, 3)
    with monkeypatch.context() as patch, Path("/dev/full").open("wb", buffering=0) as full:
        patch.setattr(writer._journal, "_file", full)
        with pytest.raises(OSError) as stopped:  # noqa: PT011  # the number of the error is what counts
            writer.record(0, 0, NONE)
    assert stopped.value.errno == errno.ENOSPC
    writer.close()
    file = read_ledger_file(tmp_path / "rank-00000.jsonl")
    assert (file.segments[0].refs, file.closed) == ((), False)
