"""The ray engine, on a cluster that ray starts on this machine."""

import os
from pathlib import Path

import fake_tasks
import pytest
import ray
from fake_stages import COPY, CopyConfig
from fake_tasks import die, die_once, fail, numbers_below, process_id, refuse

from pipelines.running.engines.ray import run_ray
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.errors import DataError, Reason, WsmError


@pytest.fixture(scope="module", autouse=True)
def cluster():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(fake_tasks.__file__).parent))
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        ray.init(num_cpus=2, include_dashboard=False)
        yield
        ray.shutdown()


def test_every_result_of_every_task_arrives_once():
    expected = sorted((task, number) for task in range(5) for number in range(task))
    assert sorted(run_ray(list(range(5)), numbers_below, 2)) == expected


def test_tasks_run_in_other_processes():
    assert os.getpid() not in set(run_ray([0, 1], process_id, 2))


def test_a_foreseen_error_arrives_whole():
    with pytest.raises(DataError, match="seven is bad") as caught:
        list(run_ray([7, 8], refuse, 2))
    assert (caught.value.reason, caught.value.details) == (Reason.FRAME_EMPTY, {"number": 7})


def test_a_bug_arrives_with_its_traceback():
    with pytest.raises(RuntimeError, match=r"(?s)in fail\n.*ZeroDivisionError"):
        list(run_ray([1, 2], fail, 2))


def test_a_task_that_kills_its_worker_each_time_is_told():
    with pytest.raises(WsmError, match="ray lost the worker of one task 3 times"):
        list(run_ray([1], die, 1))


def test_a_task_that_was_lost_with_its_worker_is_done_by_another(tmp_path):
    found = list(run_ray([str(tmp_path / "a"), str(tmp_path / "b")], die_once, 2))
    assert set(found) == {(str(tmp_path / name), number) for name in "ab" for number in range(2)}


def test_a_stage_writes_the_same_bytes_as_with_local_processes(source, tmp_path):
    (source / "a3.txt").write_text("bad")
    options = RunOptions(quiet=True, max_refused=5, workers=2)
    run_stage(COPY, CopyConfig(source=source), tmp_path / "local", options)
    run_stage(COPY, CopyConfig(source=source), tmp_path / "ray", options, run_ray)
    for name in ("copies/a1.txt", "copies/a2.txt", "copies/b1.txt", "words.json"):
        assert (tmp_path / "ray" / name).read_bytes() == (tmp_path / "local" / name).read_bytes()


def test_a_cluster_that_the_engine_started_is_stopped_at_the_end():
    ray.shutdown()
    assert len(list(run_ray([0, 1], numbers_below, 2))) == 1
    assert not ray.is_initialized()
