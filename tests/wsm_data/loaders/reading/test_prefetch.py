import threading
import time
from collections.abc import Iterator

import pytest

from wsm_data.loaders.reading.prefetch import Prefetch, done_alone

PARTS = 3


class Reading:
    """Reads steps in parts, each in a time of its own, and remembers what was going on."""

    def __init__(self, failing: tuple[int, ...] = (), parts: int = PARTS):
        self.failing = failing
        self.parts = parts
        self.announced: list[int] = []
        self.begun: list[int] = []
        self.made: list[tuple[int, int]] = []

    def announce(self, step: int) -> None:
        self.announced.append(step)

    def begin(self, step: int) -> "Step":
        self.begun.append(step)
        if step in self.failing:
            raise OSError(f"beginning of step {step}")
        return Step(self, step)


class Step:
    def __init__(self, reading: Reading, step: int):
        self.reading, self.step, self.parts = reading, step, reading.parts
        self.values: dict[int, int] = {}

    def make(self, part: int) -> None:
        number = self.step * PARTS + part
        time.sleep(0.001 * (number * 7 % 5))
        self.reading.made.append((self.step, part))
        if 1000 + number in self.reading.failing:
            raise OSError(f"step {self.step}, part {part}")
        self.values[part] = number

    def complete(self) -> list[int]:
        if -1 - self.step in self.reading.failing:
            raise OSError(f"end of step {self.step}")
        return [self.values[part] for part in range(self.parts)]


def _expected(step: int) -> list[int]:
    return [step * PARTS + part for part in range(PARTS)]


def _threads() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name.startswith("wsm-loader")}


@pytest.fixture(autouse=True)
def _no_thread_is_left_behind() -> Iterator[None]:
    before = _threads()
    yield
    assert _threads() <= before


def _prefetch(reading: Reading, steps: int, *, threads: int, depth: int) -> Prefetch[list[int]]:
    return Prefetch(iter(range(steps)), reading.begin, reading.announce, threads=threads, depth=depth)


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("depth", [0, 1, 2, 9])
def test_results_come_in_order_and_every_part_is_made_once(threads, depth):
    reading = Reading()
    assert list(_prefetch(reading, 20, threads=threads, depth=depth)) == [_expected(step) for step in range(20)]
    assert reading.announced == reading.begun == list(range(20))
    assert sorted(reading.made) == [(step, part) for step in range(20) for part in range(PARTS)]


def test_alone_the_caller_makes_the_same():
    assert done_alone(Reading().begin(4)) == _expected(4)


def test_a_step_without_parts_has_a_result():
    assert list(_prefetch(Reading(parts=0), 5, threads=2, depth=2)) == [[]] * 5


def test_threads_share_the_parts_of_a_step():
    """Both threads must come to the same step: each part waits for the other one."""
    both = threading.Barrier(2, timeout=120)

    class Meeting(Step):
        def make(self, part: int) -> None:
            both.wait()
            super().make(part)

    reading = Reading(parts=2)
    stream = Prefetch(iter(range(4)), lambda step: Meeting(reading, step), reading.announce, threads=2, depth=1)
    assert [len(result) for result in stream] == [2] * 4


@pytest.mark.parametrize("depth", [1, 3])
def test_no_more_is_read_ahead_than_asked_for(depth):
    reading = Reading()
    stream = _prefetch(reading, 50, threads=4, depth=depth)
    for delivered in range(1, 10):
        next(stream)
        time.sleep(0.01)
        assert len(reading.announced) == delivered + depth
    stream.close()
    assert len(reading.begun) <= len(reading.announced)


def test_nothing_is_read_before_the_first_result_is_asked_for():
    reading = Reading()
    stream = _prefetch(reading, 5, threads=2, depth=2)
    time.sleep(0.01)
    assert reading.announced == reading.begun == []
    stream.close()


@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize(
    ("failing", "said"),
    [
        ((6,), "beginning of step 6"),
        ((1000 + 6 * PARTS + 1,), "step 6, part 1"),
        ((1000 + 6 * PARTS + 2, 1000 + 6 * PARTS), "step 6, part 0"),
        ((-7,), "end of step 6"),
    ],
)
def test_the_first_error_of_a_step_comes_in_its_place_and_ends_the_stream(threads, failing, said):
    stream = _prefetch(Reading(failing=failing), 20, threads=threads, depth=4)
    assert [next(stream) for _ in range(6)] == [_expected(step) for step in range(6)]
    with pytest.raises(OSError, match=said):
        next(stream)
    with pytest.raises(StopIteration):
        next(stream)


def test_an_error_of_the_announcement_ends_the_stream_too():
    def announce(step: int) -> None:
        raise RuntimeError("no announcement")

    stream = Prefetch(iter(range(3)), Reading().begin, announce, threads=1, depth=1)
    with pytest.raises(RuntimeError, match="no announcement"):
        next(stream)


def test_a_closed_stream_is_at_its_end():
    stream = _prefetch(Reading(), 20, threads=2, depth=3)
    next(stream)
    stream.close()
    stream.close()
    assert next(stream, None) is None


def test_of_a_step_that_is_dropped_no_further_part_is_made():
    """Also where its beginning was underway: closing waits for the part in hand, not for the step."""
    begun, go_on = threading.Event(), threading.Event()
    reading = Reading(parts=50)

    def begin(step: int) -> Step:
        if step == 1:
            begun.set()
            assert go_on.wait(timeout=120)
        return reading.begin(step)

    stream = Prefetch(iter(range(5)), begin, reading.announce, threads=1, depth=1)
    next(stream)
    assert begun.wait(timeout=120)
    stream._drop()
    go_on.set()
    stream.close()
    assert not [part for step, part in reading.made if step == 1]


def test_threads_end_when_nobody_refers_to_the_stream_any_more():
    stream = _prefetch(Reading(), 100, threads=2, depth=3)
    next(stream)
    threads = _threads()
    assert threads
    del stream
    for thread in threads:
        thread.join(timeout=120)
        assert not thread.is_alive()
