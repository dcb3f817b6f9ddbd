import threading
import time
from collections.abc import Iterator

import pytest

from wsm_data.loaders.prefetch import Prefetch


class Work:
    """Reads steps, each in a time of its own, and remembers what was going on."""

    def __init__(self, failing: int = -1):
        self.failing = failing
        self.announced: list[int] = []
        self.started: list[int] = []
        self._lock = threading.Lock()

    def announce(self, step: int) -> None:
        self.announced.append(step)

    def read(self, step: int) -> int:
        with self._lock:
            self.started.append(step)
        time.sleep(0.001 * (step * 7 % 5))
        if step == self.failing:
            raise OSError(f"step {step}")
        return step * step


def _threads() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name.startswith("wsm-loader")}


@pytest.fixture(autouse=True)
def _no_thread_is_left_behind() -> Iterator[None]:
    before = _threads()
    yield
    assert _threads() <= before


def _prefetch(work: Work, steps: int, *, threads: int, depth: int) -> Prefetch[int]:
    return Prefetch(iter(range(steps)), work.read, work.announce, threads=threads, depth=depth)


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("depth", [0, 1, 2, 9])
def test_results_come_in_order(threads, depth):
    work = Work()
    assert list(_prefetch(work, 20, threads=threads, depth=depth)) == [step * step for step in range(20)]
    assert work.announced == list(range(20))


@pytest.mark.parametrize("depth", [1, 3])
def test_no_more_is_read_ahead_than_asked_for(depth):
    work = Work()
    stream = _prefetch(work, 50, threads=4, depth=depth)
    for delivered in range(1, 10):
        next(stream)
        time.sleep(0.01)
        assert len(work.announced) == delivered + depth
    stream.close()
    assert len(work.started) <= len(work.announced)


def test_nothing_is_read_before_the_first_result_is_asked_for():
    work = Work()
    stream = _prefetch(work, 5, threads=2, depth=2)
    time.sleep(0.01)
    assert work.announced == work.started == []
    stream.close()


@pytest.mark.parametrize("threads", [1, 4])
def test_an_error_comes_at_its_step_and_ends_the_stream(threads):
    work = Work(failing=6)
    stream = _prefetch(work, 20, threads=threads, depth=4)
    assert [next(stream) for _ in range(6)] == [step * step for step in range(6)]
    with pytest.raises(OSError, match="step 6"):
        next(stream)
    with pytest.raises(StopIteration):
        next(stream)


def test_an_error_of_the_announcement_ends_the_stream_too():
    def announce(step: int) -> None:
        raise RuntimeError("no announcement")

    stream = Prefetch(iter(range(3)), abs, announce, threads=1, depth=1)
    with pytest.raises(RuntimeError, match="no announcement"):
        next(stream)


def test_a_closed_stream_is_at_its_end():
    stream = _prefetch(Work(), 20, threads=2, depth=3)
    next(stream)
    stream.close()
    stream.close()
    assert next(stream, None) is None


def test_threads_end_when_nobody_refers_to_the_stream_any_more():
    stream = _prefetch(Work(), 100, threads=2, depth=3)
    next(stream)
    threads = _threads()
    assert threads
    del stream
    for thread in threads:
        thread.join(timeout=5)
        assert not thread.is_alive()
