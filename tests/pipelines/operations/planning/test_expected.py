"""A plan from measured numbers that were made up so that it can be computed by hand."""

from pathlib import Path

import pytest

from pipelines.operations.planning.expected import expected, measured_workers
from pipelines.operations.planning.sample import Measured, MeasuredStage, SourceSizes
from pipelines.running.stage import Unit

GIB = 1 << 30
SOURCE = SourceSizes(
    root=Path("source"),
    size_bytes=1000,
    units=tuple(Unit(id=f"c{number}", inputs={}) for number in range(10)),
    sizes={f"c{number}": 100 for number in range(10)},
)


def stage(by_container=None, unit_seconds=0.0, idle=0.0, folder_bytes=0):
    spent = sum(by_container.values()) if by_container else unit_seconds
    return MeasuredStage(
        seconds=spent + idle,
        idle_seconds=idle,
        by_container=by_container or {},
        unit_seconds=spent,
        folder_bytes=folder_bytes,
    )


MEASURED = Measured(
    containers=("c0", "c1"),
    stages={
        "index": stage({"c0": 36.0, "c1": 36.0}, idle=3.6, folder_bytes=10),
        "encode": stage({"c0": 360.0, "c1": 360.0}, folder_bytes=GIB),
        "pack": stage(unit_seconds=36.0, folder_bytes=GIB),
        "verify": stage(unit_seconds=36.0),
        "report": stage(unit_seconds=36.0, folder_bytes=7),
    },
    clip_bytes={"c0": GIB // 2, "c1": GIB // 2},
    release_bytes=GIB,
)


def plan(workers, shard_bytes=GIB):
    return expected("interndata", SOURCE, MEASURED, workers, 0, shard_bytes)


def test_bytes_grow_with_the_source_and_the_pictures_of_the_report_do_not():
    found = plan(1)
    assert found.bytes_out.value == pytest.approx(5 * GIB)
    assert found.peak_disk_bytes.value == pytest.approx(10 * GIB + 50 + 7)
    assert (found.bytes_in, found.containers, found.sampled_containers, found.sampled_bytes) == (1000, 10, 2, 200)


def test_hours_of_one_worker_are_those_of_its_units_and_what_a_stage_needs_once():
    hours = {name: one.value for name, one in plan(1).stage_hours.items()}
    assert hours == pytest.approx({"index": 0.101, "encode": 1.0, "pack": 0.05, "verify": 0.05, "report": 0.01})
    assert plan(1).hours.value == pytest.approx(1.211)


def test_workers_share_containers_and_shards_and_none_is_divided():
    hours = {name: one.value for name, one in plan(4).stage_hours.items()}
    assert hours["encode"] == pytest.approx(0.3)  # ten containers of 0.1 h: three rounds of four
    assert hours["pack"] == pytest.approx(0.0125)  # five shards
    assert hours["verify"] == pytest.approx(0.05)
    assert plan(4, shard_bytes=8 * GIB).stage_hours["pack"].value == pytest.approx(0.05)  # one shard


def test_a_sample_has_no_more_workers_than_this_machine_has_cores(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    assert [measured_workers(one) for one in (1, 2, 64)] == [1, 2, 2]
    assert (plan(64).workers, plan(64).measured_workers) == (64, 2)
