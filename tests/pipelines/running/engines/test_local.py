"""The process pool: every result arrives, failures are told, nothing hangs, and no worker outlives its parent."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time

import pytest
from fake_tasks import (
    die,
    die_at_one,
    die_once,
    fail,
    hang_once,
    loaded_modules,
    numbers_below,
    parent_process_id,
    process_id,
    refuse,
    wait_and_touch,
    zeros,
)

from pipelines.running.engines.local import run_local
from wsm_data.errors import DataError, Reason, WsmError


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_every_result_of_every_task_arrives_once(workers):
    expected = sorted((task, number) for task in range(5) for number in range(task))
    assert sorted(run_local(range(5), numbers_below, workers)) == expected


def test_results_of_one_task_keep_their_order():
    results = list(run_local([40, 30, 20], numbers_below, 2))
    assert [number for task, number in results if task == 40] == list(range(40))


def test_one_worker_works_here_and_more_work_elsewhere():
    assert set(run_local([0, 1], process_id, 1)) == {os.getpid()}
    assert os.getpid() not in set(run_local([0, 1], process_id, 2))


def test_results_larger_than_a_pipe_holds_arrive_whole():
    sizes = [len(result) for result in run_local([2_000_000, 3_000_000], zeros, 2)]
    assert sorted(sizes) == [2_000_000, 3_000_000]


@pytest.mark.parametrize("workers", [1, 2])
def test_a_foreseen_error_arrives_whole(workers):
    with pytest.raises(DataError, match="seven is bad") as caught:
        list(run_local([7, 8], refuse, workers))
    assert (caught.value.reason, caught.value.details) == (Reason.FRAME_EMPTY, {"number": 7})


def test_a_bug_arrives_with_the_traceback_of_the_worker():
    with pytest.raises(RuntimeError, match=r"(?s)a worker failed:.*fake_tasks\.py.*in fail\n.*ZeroDivisionError"):
        list(run_local([1, 2], fail, 2))


def test_a_worker_that_dies_is_told_with_its_exit_code():
    with pytest.raises(WsmError, match=r"a worker process died \(exit code 9;"):
        list(run_local([1, 2], die, 2))


def test_a_task_whose_worker_was_killed_is_begun_again_where_that_is_asked_for(tmp_path):
    marks = [str(tmp_path / name) for name in "ab"]
    found = list(run_local(marks, die_once, 2, attempts=2))
    assert set(found) == {(mark, number) for mark in marks for number in range(2)}


def test_a_task_that_kills_its_worker_each_time_ends_the_run_after_the_others_are_done():
    found = []
    with pytest.raises(WsmError, match=r"exit code 9; .*, 2 times at the same units; what was finished is kept"):
        found.extend(collect(run_local([1, 0, 2, 3], die_at_one, 2, attempts=2), found))
    assert sorted(set(found)) == [0, 1, 2, 3]


def collect(results, found):
    """Keeps what came before an error."""
    for result in results:
        found.append(result)
    return ()


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_hangs_is_killed_and_what_it_was_at_is_begun_again(tmp_path, workers):
    marks = [str(tmp_path / name) for name in "ab"]
    started = time.monotonic()
    assert sorted(run_local(marks, hang_once, workers, attempts=2, silence_s=1.0)) == marks
    assert time.monotonic() - started < 100  # it would sleep for 600 s
    assert multiprocessing.active_children() == []


def test_a_worker_that_hangs_each_time_ends_the_run(tmp_path):
    with pytest.raises(WsmError, match=r"a unit hung for 0\.3 s, 2 times at the same units"):
        list(run_local([str(tmp_path / "mark")], wait_and_touch, 1, attempts=2, silence_s=0.3))
    assert multiprocessing.active_children() == []


FAILING_PARENT = """
from fake_tasks import fail_to_pickle
from pipelines.running.engines.local import run_local
if __name__ == "__main__":
    list(run_local([1, 2], fail_to_pickle, 2))
"""


def test_a_result_that_does_not_pickle_is_told_and_not_lost(tmp_path, fakes_on_path):
    """In a program of its own: workers write to what was the standard error when their server was started."""
    program = tmp_path / "program.py"
    program.write_text(FAILING_PARENT)
    done = subprocess.run([sys.executable, program], env=fakes_on_path, capture_output=True, text=True, timeout=300)
    assert "Can't pickle local object" in done.stderr
    assert "WsmError: a worker process died (exit code 1;" in done.stderr


def test_workers_of_one_run_after_another_come_from_one_server():
    """What they load is loaded once."""
    parents = {parent for _ in range(2) for parent in run_local([0, 1], parent_process_id, 2)}
    assert len(parents) == 1
    assert os.getpid() not in parents


def test_workers_start_with_the_kernels_of_the_stages_loaded():
    assert all("pipelines.stages.encode" in names for names in run_local([0, 1], loaded_modules, 2))


def test_a_task_that_does_not_pickle_is_told():
    with pytest.raises((TypeError, AttributeError), match="pickle"):
        list(run_local([lambda: None, lambda: None], numbers_below, 2))


def test_closing_ends_the_workers(tmp_path):
    results = run_local([0, 1, 2, 3], process_id, 2)
    next(results)
    results.close()
    assert multiprocessing.active_children() == []


def is_alive(pid):
    """Whether a process still runs; one that only waits to be reaped does not."""
    try:
        with open(f"/proc/{pid}/stat") as file:  # noqa: PTH123 - a file that may vanish while it is read
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def until(condition, limit_s=60.0):
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


PARENT = """
import sys
from fake_tasks import wait_and_touch
from pipelines.running.engines.local import run_local
if __name__ == "__main__":
    for result in run_local(sys.argv[1:], wait_and_touch, 2): pass
"""


@pytest.fixture
def parent(tmp_path, fakes_on_path):
    """A program whose two workers are busy; yields it with the workers' process ids."""
    program = tmp_path / "program.py"
    program.write_text(PARENT)
    marks = [tmp_path / "one", tmp_path / "two"]
    with subprocess.Popen(
        [sys.executable, program, *map(str, marks)], env=fakes_on_path, stderr=subprocess.PIPE
    ) as child:
        until(lambda: all(mark.exists() and mark.read_text() for mark in marks))
        yield child, [int(mark.read_text()) for mark in marks]
        child.kill()


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_workers_end_in_the_middle_of_a_task_when_their_parent_is_killed(parent):
    child, workers = parent
    assert all(map(is_alive, workers))
    child.kill()
    until(lambda: not any(map(is_alive, workers)))


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_ctrl_c_is_the_parents_and_ends_everything(parent):
    child, workers = parent
    for worker in workers:
        os.kill(worker, signal.SIGINT)  # a terminal sends it to the whole group
    time.sleep(0.2)
    assert all(map(is_alive, workers))
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=300)
    assert said.count(b"Traceback") == 1  # the parent's own; workers are silent
    assert said.rstrip().endswith(b"KeyboardInterrupt")
    assert not any(map(is_alive, workers))
