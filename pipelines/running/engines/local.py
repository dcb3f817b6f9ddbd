"""Batches of work in this process or in worker processes on this machine; knows no stage."""

import logging
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import inf
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError

_LOG = logging.getLogger(__name__)
_DEATH_WAIT_S = 5.0

_LOADED_BY_THE_SERVER = ["pipelines.warm_start"]
"""By name: this module knows no stage. A module that cannot be imported there is left out."""


@dataclass(frozen=True)
class _TaskEnded:
    """A worker has sent everything of one task."""


@dataclass
class _AtWork:
    """A task of a worker.

    Attributes:
        index: which task.
        attempt: how often it was begun, this time included.
        heard_s: when its worker was last heard of, on the monotonic clock.
    """

    index: int
    attempt: int
    heard_s: float


def run_local(
    tasks: Sequence[TaskT],
    work: Callable[[TaskT], Iterator[ResultT]],
    workers: int,
    *,
    attempts: int = 1,
    silence_s: float = inf,
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task and yield its results as they come, in no particular order across tasks.

    With one worker everything happens in this process, unless it must be watched. More are forked from a server process
    that is started once, and does nothing but load what all of them need: so a stage's workers are there at once, and
    nothing is inherited from threads or libraries of this process, so results cannot depend on what it did before.
    Workers end when the generator is closed, and when this process ends, even if it is killed; the server ends with it.

    Args:
        tasks: must pickle, as must `work` and its results, when workers > 1.
        work: generator function of one task.
        workers: number of processes.
        attempts: how often a task is begun whose worker dies; what it gave before comes again then.
        silence_s: a worker that gives no result for so long hangs, and is killed; any process can be watched so but
            this one, so that one worker is a process of its own then.

    Raises:
        WsmError: a task raised one, or workers died or hung at it in every attempt.
        RuntimeError: a task in a worker raised anything else; the message is its traceback.
    """
    if (workers <= 1 or len(tasks) <= 1) and silence_s == inf:
        limit_threads()
        for task in tasks:
            yield from work(task)
        return
    if tasks:
        yield from _run_pool(tasks, work, min(max(workers, 1), len(tasks)), attempts, silence_s)


def _run_pool(
    tasks: Sequence[TaskT],
    work: Callable[[TaskT], Iterator[ResultT]],
    workers: int,
    attempts: int,
    silence_s: float,
) -> Generator[ResultT, None, None]:
    """One connection a worker, and one task at a time on it.

    A queue that all share would hang where a worker dies while it holds the queue's lock, and would lose what does
    not pickle. A connection ends with its worker, and says so.
    """
    pool: dict[Connection, BaseProcess] = {}
    waiting = deque((index, 1) for index in range(len(tasks)))
    at_work: dict[Connection, _AtWork] = {}
    given_up: list[str] = []  # from the first of them on nothing more is begun, and what is at work is waited for
    try:
        with _interrupts_held_back():
            for _ in range(workers):
                connection, process = _start(work)
                pool[connection] = process
        while at_work or (waiting and not given_up):
            for connection in [one for one in pool if one not in at_work][: 0 if given_up else len(waiting)]:
                index, attempt = waiting.popleft()
                at_work[connection] = _AtWork(index, attempt, time.monotonic())
                with suppress(OSError):  # it has died: that is seen below
                    connection.send(tasks[index])
            ready = wait(at_work, None if silence_s == inf else _time_left(at_work, silence_s))
            for connection in [one for one in at_work if one in ready]:
                try:
                    result: ResultT | TaskFailed | _TaskEnded = connection.recv()
                except (EOFError, OSError):
                    pool[connection].join(_DEATH_WAIT_S)
                    connection.close()
                    _lose(at_work.pop(connection), _death(pool.pop(connection)), attempts, waiting, given_up)
                    continue
                at_work[connection].heard_s = time.monotonic()
                if isinstance(result, _TaskEnded):
                    del at_work[connection]
                else:
                    yield unless_failed(result)
            for connection in [
                one for one, begun in at_work.items() if _is_silent(begun, silence_s) and not one.poll()
            ]:
                process = pool.pop(connection)
                process.kill()
                process.join()
                connection.close()
                _lose(at_work.pop(connection), f"a unit hung for {silence_s:g} s", attempts, waiting, given_up)
            for _ in range(
                0 if given_up else min(workers - len(pool), len(waiting))
            ):  # in the place of those that died
                with _interrupts_held_back():
                    connection, process = _start(work)
                    pool[connection] = process
        if given_up:
            raise WsmError(given_up[0])
    finally:
        for process in pool.values():
            process.terminate()
        for connection, process in pool.items():
            process.join()
            connection.close()


def _time_left(at_work: Mapping[Connection, _AtWork], silence_s: float) -> float:
    """Until the first of the workers has been silent for too long, s."""
    return max(0.0, min(one.heard_s for one in at_work.values()) + silence_s - time.monotonic())


def _is_silent(begun: _AtWork, silence_s: float) -> bool:
    return time.monotonic() - begun.heard_s >= silence_s


def _lose(lost: _AtWork, cause: str, attempts: int, waiting: deque[tuple[int, int]], given_up: list[str]) -> None:
    """Put a task whose worker is gone behind all others, or give it up after its last attempt."""
    if lost.attempt < attempts:
        _LOG.warning("%s; what it was at is begun again, attempt %d", cause, lost.attempt + 1)
        waiting.append((lost.index, lost.attempt + 1))
        return
    times = f", {attempts} times at the same units" if attempts > 1 else ""
    given_up.append(
        f"{cause}{times}; what was finished is kept: run the same command again, with fewer --workers if it recurs"
    )


def _death(process: BaseProcess) -> str:
    return (
        f"a worker process died (exit code {process.exitcode}; -9 usually means that memory ran out, 1 that it "
        "could not start or send a result: its own message stands above)"
    )


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Ctrl-C is this process's to handle: workers inherit that it is blocked, here it is delivered at the end."""
    resource_tracker.ensure_running()  # what the start of the server would do otherwise, and it unblocks Ctrl-C again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.set_forkserver_preload(_LOADED_BY_THE_SERVER)
        forkserver.ensure_running()
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start(work: Callable[[TaskT], Iterator[ResultT]]) -> tuple[Connection, BaseProcess]:
    context = multiprocessing.get_context("forkserver")
    ours, theirs = context.Pipe()
    process = context.Process(target=_worker, args=(work, theirs), daemon=True)
    process.start()
    theirs.close()  # the worker's copy is the last one: when the worker ends, ours reads the end of the stream
    return ours, process


def _worker(work: Callable[[TaskT], Iterator[ResultT]], connection: Connection) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    limit_threads()
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):  # the driver was killed: nobody is there to be told
        while True:
            task = connection.recv()
            for result in results_of(work, task):
                connection.send(result)
            connection.send(_TaskEnded())


def _end_with_parent() -> None:
    """End this process when the parent does: a resumed run must not meet writers of the run before it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
