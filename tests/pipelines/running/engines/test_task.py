"""What crosses from a worker to its parent."""

import pytest
from fake_runs import ANY
from fake_stages import COPY, CopyConfig
from fake_tasks import fail, refuse

from pipelines.running.engines.task import TaskFailed, results_of, unless_failed
from pipelines.running.runner import run_stage
from wsm_data.errors import DataError


def test_results_before_a_failure_are_kept_and_the_failure_comes_last():
    *results, failure = results_of(refuse, 7)
    assert results == [0, 1]
    with pytest.raises(DataError, match="seven is bad"):
        unless_failed(failure)


def test_a_bug_travels_as_its_traceback():
    *results, failure = results_of(fail, 7)
    assert results == [1.0]
    assert isinstance(failure, TaskFailed)
    assert failure.error is None
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        unless_failed(failure)


def test_ctrl_c_is_no_failure_of_a_task():
    def interrupted(_):
        raise KeyboardInterrupt
        yield

    with pytest.raises(KeyboardInterrupt):
        list(results_of(interrupted, 1))


def test_outcomes_that_come_again_after_a_loss_are_written_down_once(source, tmp_path):
    """Each unit is given twice, as by a task that was lost after its first outcome."""

    def twice(tasks, work, _workers):
        for task in tasks:
            yield from work(task)
            yield from work(task)

    options = ANY
    report = run_stage(COPY, CopyConfig(source=source), tmp_path / "out", options, twice)
    assert (report.done, len(report.ran)) == (3, 3)
    assert len((tmp_path / "out" / "ledger.jsonl").read_text().splitlines()) == 3
