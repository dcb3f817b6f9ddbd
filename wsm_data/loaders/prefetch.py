"""Reading ahead with threads of the training process: results in order, errors at their place, nothing left behind."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

Result = TypeVar("Result")


class Prefetch(Generic[Result]):
    """An iterator over `read(step)` for each step, of which some are read before they are asked for.

    An error of a step, or an interrupt while it is waited for, is raised where its result would come; what was read
    ahead behind it is dropped, but not waited for: `close` does that, when whoever knows how has cut short what the
    threads wait for. Threads end when the iterator ends, fails, or is closed, and at the latest when nobody refers to
    it any more.
    """

    def __init__(
        self,
        steps: Iterator[int],
        read: Callable[[int], Result],
        announce: Callable[[int], None],
        *,
        threads: int,
        depth: int,
    ):
        """Start reading when first asked for a result.

        Args:
            steps: what is read, in this order.
            read: called in several threads at the same time.
            announce: called before `read`, in the order of the steps, in the thread that advances the iterator.
            threads: number of threads.
            depth: results that are read ahead of the one that is delivered.
        """
        self._steps, self._read, self._announce = steps, read, announce
        self._depth = max(depth, 1)
        self._wanted = 1  # the first result comes soonest while nothing else takes memory and its bandwidth
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix="wsm-loader")
        self._pending: deque[Future[Result]] = deque()

    def __iter__(self) -> Iterator[Result]:
        return self

    def __next__(self) -> Result:
        try:
            self._fill()
            if not self._pending:
                self.close()
                raise StopIteration
            result = self._pending.popleft().result()
            self._wanted = self._depth
            self._fill()
        except BaseException:
            self._drop()
            raise
        return result

    def close(self) -> None:
        """Drop what was read ahead and wait for the threads to end."""
        self._drop()
        self._executor.shutdown(wait=True)

    def _drop(self) -> None:
        self._steps = iter(())
        self._pending.clear()
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _fill(self) -> None:
        while len(self._pending) < self._wanted:
            step = next(self._steps, None)
            if step is None:
                return
            self._announce(step)
            self._pending.append(self._executor.submit(self._read, step))
