"""Runs of a stage that end early: a full disk, Ctrl-C, a dead worker; each leaves a folder that can be resumed."""

import multiprocessing
import os
from dataclasses import replace

import pytest
from fake_runs import ANY, copies
from fake_stages import COPY

from pipelines.running.folder import locked, read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.runner import run_stage
from wsm_data.errors import BudgetExceeded, ConfigError, WsmError


@pytest.mark.parametrize("workers", [1, 2])
def test_a_full_disk_is_said_and_the_run_can_be_resumed(config, out, calls, workers):
    (config.source / "a2.txt").write_text("disk full")
    with pytest.raises(WsmError, match=r"the disk of .*copy is full .*what is done is kept"):
        run_stage(COPY, config, out, replace(ANY, workers=workers))
    (config.source / "a2.txt").write_text("there is room now")
    run_stage(COPY, config, out, ANY)
    assert copies(out)["a2"] == "there is room now"


def test_a_ledger_that_finds_no_room_is_a_full_disk_too(config, out, monkeypatch):
    run_stage(COPY, config, out, replace(ANY, limit=1))

    def no_room(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", no_room)
        with pytest.raises(WsmError, match=r"the disk of .* is full"):
            run_stage(COPY, config, out, ANY)
    assert run_stage(COPY, config, out, ANY).done == 3


def test_another_error_of_the_system_is_not_taken_for_a_full_disk(config, out):
    (config.source / "a2.txt").write_text("no permission")
    with pytest.raises(PermissionError):
        run_stage(COPY, config, out, ANY)


def test_ctrl_c_leaves_what_is_done_and_the_next_run_goes_on(config, out, calls):
    (config.source / "a2.txt").write_text("interrupted")
    with pytest.raises(KeyboardInterrupt):
        run_stage(COPY, config, out, ANY)
    assert list(read_ledger(out)) == ["a1"]
    with locked(out):  # the lock has fallen
        pass
    (config.source / "a2.txt").write_text("text of a2")
    calls()
    run_stage(COPY, config, out, ANY)
    assert calls() == ["a2", "b1", "finish"]


def test_one_and_two_workers_write_the_same_bytes(config, out, tmp_path):
    (config.source / "a3.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    two = tmp_path / "two"
    run_stage(COPY, config, two, replace(ANY, workers=2))
    ledger = read_ledger(two)
    assert os.getpid() not in {entry.outcome.facts.get("pid") for entry in ledger.values()}
    assert copies(two) == copies(out)
    assert (two / "words.json").read_bytes() == (out / "words.json").read_bytes()
    assert read_stage_record(two).finished == read_stage_record(out).finished


def test_when_a_worker_dies_that_is_said_and_the_run_can_be_resumed(config, out):
    (config.source / "a2.txt").write_text("dies")
    with pytest.raises(WsmError, match=r"a worker process died \(exit code 7"):
        run_stage(COPY, config, out, replace(ANY, workers=2))
    (config.source / "a2.txt").write_text("lives")
    run_stage(COPY, config, out, ANY)
    assert copies(out)["a2"] == "lives"


def test_after_the_budget_no_worker_is_left_although_the_error_is_held(config, out):
    for name in ("a1", "a2", "b1"):
        (config.source / f"{name}.txt").write_text("bad")
    with pytest.raises(BudgetExceeded) as held:
        run_stage(COPY, config, out, replace(ANY, max_refused=0, workers=2))
    assert multiprocessing.active_children() == []
    assert held.tb is not None


def test_a_folder_that_another_run_writes_is_refused(config, out):
    with locked(out), pytest.raises(ConfigError, match="being written by another wsm process"):
        run_stage(COPY, config, out, ANY)
