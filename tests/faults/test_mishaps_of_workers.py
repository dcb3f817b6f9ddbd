"""A worker that is killed, hangs or runs out of memory, a clock that is wrong: the bytes are those of a quiet run."""

import time
from dataclasses import replace

import pytest
from fake_runs import ANY, copies
from fake_stages import COPY
from misbehaving import EATING, HANGING, KILLED

from pipelines.running.engines.choice import opened
from pipelines.running.runner import run_stage
from wsm_data.errors import WsmError

HOUR_S = 3600.0


@pytest.fixture
def quiet(config, tmp_path):
    """What an undisturbed run writes."""
    run_stage(COPY, config, tmp_path / "quiet", ANY)
    return written(tmp_path / "quiet")


def written(out):
    return copies(out), (out / "words.json").read_bytes()


def two_workers(stage, config, out, **options):
    with opened("local", **options) as engine:
        return run_stage(stage, config, out, replace(ANY, workers=2), engine)


@pytest.mark.parametrize(("stage", "options"), [(KILLED, {}), (HANGING, {"unit_timeout_s": 2.0})], ids=["KILL", "hang"])
def test_a_worker_that_is_killed_or_hangs_costs_no_run(stage, options, config, out, quiet, tmp_path, faults):
    report = two_workers(stage, config, out, **options)
    assert (tmp_path / "misbehaved").exists()
    assert (report.done, report.pending) == (3, 0)
    assert written(out) == quiet
    assert run_stage(COPY, config, out, ANY).ran == ()
    faults["workers killed or hanging"] += 1


@pytest.mark.parametrize("workers", [1, 2])
def test_a_unit_that_eats_memory_is_named_and_the_next_run_goes_on(config, out, quiet, workers, faults):
    with pytest.raises(WsmError, match=r"memory ran out at a2; what is finished is kept"):
        run_stage(EATING, config, out, replace(ANY, workers=workers))
    run_stage(EATING, config, out, ANY)
    assert written(out) == quiet
    faults["units that ran out of memory"] += 1


def test_a_clock_that_is_an_hour_off_on_one_machine_and_back_on_the_next_redoes_nothing(
    config, out, quiet, calls, monkeypatch, faults
):
    now = time.time
    calls()
    for shift, limit in ((HOUR_S, 1), (-HOUR_S, 2), (0.0, 0)):
        monkeypatch.setattr(time, "time", lambda shift=shift: now() + shift)
        run_stage(COPY, config, out, replace(ANY, limit=limit))
        faults["clocks an hour off"] += bool(shift)
    assert [one for one in calls() if one != "finish"] == ["a1", "a2", "b1"]
    assert written(out) == quiet
