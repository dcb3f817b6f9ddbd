"""Batches of work in this process or in worker processes on this machine; knows no stage."""

import multiprocessing
import os
import queue
import signal
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from wsm_data.errors import WsmError

TaskT = TypeVar("TaskT")
ResultT = TypeVar("ResultT")

_POLL_S = 0.5
_TASKS_IN_FLIGHT_PER_WORKER = 2


@dataclass(frozen=True)
class _TaskEnded:
    """A worker has yielded everything of one task."""


@dataclass(frozen=True)
class _TaskFailed:
    """A worker's task raised; foreseen errors travel whole, bugs as their traceback."""

    error: WsmError | OSError | None
    trace: str


def run_local(tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int) -> Iterator[ResultT]:
    """Apply `work` to every task and yield its results as they come, in no particular order across tasks.

    With one worker everything happens in this process. More are started afresh (`spawn`): nothing is inherited from
    threads or libraries of this one, so results cannot depend on what it did before. Workers end when this process
    does, even if it is killed.

    Args:
        tasks: must pickle, as must `work`, when workers > 1.
        work: generator function of one task.
        workers: number of processes.

    Raises:
        WsmError: a task raised one, or a worker died.
        RuntimeError: a task raised anything else; the message is its traceback.
    """
    if workers <= 1 or len(tasks) <= 1:
        limit_threads()
        for task in tasks:
            yield from work(task)
        return
    yield from _run_pool(tasks, work, min(workers, len(tasks)))


def limit_threads() -> None:
    """One thread per process for OpenCV and BLAS: processes are the parallelism, and sums do not depend on cores."""
    import cv2  # loaded here so that the command line stays light
    from threadpoolctl import threadpool_limits

    cv2.setNumThreads(1)
    threadpool_limits(limits=1)


def _run_pool(tasks: Sequence[Any], work: Callable[[Any], Iterator[Any]], workers: int) -> Iterator[Any]:
    context = multiprocessing.get_context("spawn")
    to_do: Any = context.Queue()
    results: Any = context.Queue()
    processes = [context.Process(target=_worker, args=(work, to_do, results), daemon=True) for _ in range(workers)]
    waiting = iter(tasks)
    open_tasks = 0
    for process in processes:
        process.start()
    try:
        for _ in range(workers * _TASKS_IN_FLIGHT_PER_WORKER):
            open_tasks += _put_next(waiting, to_do)
        while open_tasks:
            result = _next_result(results, processes)
            if isinstance(result, _TaskEnded):
                open_tasks += _put_next(waiting, to_do) - 1
            elif isinstance(result, _TaskFailed):
                raise result.error or RuntimeError(f"a worker failed:\n{result.trace}")
            else:
                yield result
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.join()


def _put_next(waiting: Iterator[Any], to_do: Any) -> int:
    for task in waiting:
        to_do.put(task)
        return 1
    return 0


def _next_result(results: Any, processes: Sequence[BaseProcess]) -> Any:
    while True:
        try:
            return results.get(timeout=_POLL_S)
        except queue.Empty:
            for process in processes:
                if process.exitcode is not None:
                    raise WsmError(
                        f"a worker process died (exit code {process.exitcode}; -9 usually means that memory ran out); "
                        "what was finished is kept: run the same command again, with fewer --workers if it recurs"
                    ) from None


def _worker(work: Callable[[Any], Iterator[Any]], to_do: Any, results: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    limit_threads()
    while True:
        try:
            task = to_do.get(timeout=_POLL_S)
        except queue.Empty:
            if not _parent_alive():
                return
            continue
        try:
            for result in work(task):
                results.put(result)
        except (WsmError, OSError) as error:
            results.put(_TaskFailed(error, ""))
        except Exception:  # noqa: BLE001 - a bug must reach the parent with its traceback instead of a silent death
            results.put(_TaskFailed(None, traceback.format_exc()))
        results.put(_TaskEnded())


def _parent_alive() -> bool:
    parent = multiprocessing.parent_process()
    return parent is not None and parent.is_alive() and os.getppid() != 1
