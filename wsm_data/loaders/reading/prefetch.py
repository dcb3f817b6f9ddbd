"""Reading ahead with threads of the training process: results in order, errors at their place, nothing left behind.

All threads work on the same result until it is complete, and only then on the next one. So the first result comes
soonest, and memory is filled while it is still in the processor's cache: two threads that fill one batch after the
other are faster than two that fill a batch each.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, Protocol, TypeVar

Result = TypeVar("Result")
Made = TypeVar("Made", covariant=True)

_NO_PARTS = iter(range(0))


class Work(Protocol[Made]):
    """A result in parts, which may be made in any order and by several threads at the same time."""

    @property
    def parts(self) -> int:
        """How many there are."""

    def make(self, part: int) -> None:
        """Make one of them."""

    def complete(self) -> Made:
        """The result, once all parts are made."""


def done_alone(work: Work[Result]) -> Result:
    """The result, made by the caller."""
    for part in range(work.parts):
        work.make(part)
    return work.complete()


class Prefetch(Generic[Result]):
    """An iterator over what is made of each step, of which some are worked on before they are asked for.

    An error of a step, or an interrupt while it is waited for, is raised where its result would come; what was read
    ahead behind it is dropped, but not waited for: `close` does that, when whoever knows how has cut short what the
    threads wait for. Threads end when the iterator ends, fails, or is closed, and at the latest when nobody refers to
    it any more.
    """

    def __init__(
        self,
        steps: Iterator[int],
        begin: Callable[[int], Work[Result]],
        announce: Callable[[int], None],
        *,
        threads: int,
        depth: int,
    ):
        """Start reading when first asked for a result.

        Args:
            steps: what is read, in this order.
            begin: gives the work of a step; called in any of the threads.
            announce: called before `begin`, in the order of the steps, in the thread that advances the iterator.
            threads: number of threads.
            depth: results that are read ahead of the one that is delivered.
        """
        self._steps, self._begin, self._announce = steps, begin, announce
        self._depth = max(depth, 1)
        self._wanted = 1  # the first result comes soonest while nothing else takes memory and its bandwidth
        self._threads = threads
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="wsm-loader")
        self._pending: deque[tuple[_Shared[Result], list[Future[Result | None]]]] = deque()

    def __iter__(self) -> Iterator[Result]:
        return self

    def __next__(self) -> Result:
        try:
            self._fill()
            if not self._pending:
                self.close()
                raise StopIteration
            shared, helpers = self._pending[0]
            result = shared.result(helpers)
            self._pending.popleft()
            self._wanted = self._depth
            self._fill()
        except BaseException:  # an error of a step, or an interrupt while it is waited for
            self._drop()
            raise
        return result

    def close(self) -> None:
        """Drop what was read ahead and wait for the threads to end."""
        self._drop()
        self._executor.shutdown(wait=True)

    def _drop(self) -> None:
        self._steps = iter(())
        while self._pending:
            self._pending.pop()[0].give_up()
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _fill(self) -> None:
        while len(self._pending) < self._wanted:
            step = next(self._steps, None)
            if step is None:
                return
            self._announce(step)
            shared = _Shared(self._begin, step)
            self._pending.append((shared, [self._executor.submit(shared.help) for _ in range(self._threads)]))


class _Shared(Generic[Result]):
    """The work of one step: begun by the first thread that comes, and completed by the last one that leaves."""

    def __init__(self, begin: Callable[[int], Work[Result]], step: int):
        self._begin, self._step = begin, step
        self._beginning, self._counting = threading.Lock(), threading.Lock()
        self._work: Work[Result] | None = None
        self._parts = _NO_PARTS
        self._helpers = 0
        self._is_over = False
        self._errors: dict[int, BaseException] = {}  # by part; -1: of the beginning

    def help(self) -> Result | None:
        """Make parts until none is left; returns the result to who leaves last."""
        with self._counting:
            if self._is_over:
                return None
            self._helpers += 1
        self._make_parts()
        with self._counting:
            self._helpers -= 1
            if self._helpers or self._is_over:
                return None
            self._is_over = True
        work, self._work = self._work, None
        return None if work is None or self._errors else work.complete()

    def result(self, helpers: list[Future[Result | None]]) -> Result:
        """Wait for all who help. Parts are begun in order: the first that fails is the same with any threads."""
        for helper in helpers:
            helper.exception()  # waits
        if self._errors:
            raise self._errors[min(self._errors)]
        return next(result for helper in helpers if (result := helper.result()) is not None)

    def give_up(self) -> None:
        """Nobody wants the result any more: begin nothing, and make no further part."""
        with self._counting:
            self._is_over, self._parts = True, _NO_PARTS

    def _make_parts(self) -> None:
        part = -1
        try:
            with self._beginning:
                if self._work is None and not self._errors and not self._is_over:
                    self._work = self._begin(self._step)
                    self._parts = iter(range(self._work.parts))
            work = self._work
            while work is not None and not self._is_over and (part := next(self._parts, -1)) >= 0:
                work.make(part)
        except BaseException as error:  # kept with its part, and raised again
            self._errors[part], self._parts = error, _NO_PARTS
            raise
