"""Batches of work in this process or in worker processes on this machine; knows no stage."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError

_DEATH_WAIT_S = 5.0

_LOADED_BY_THE_SERVER = ["pipelines.warm_start"]
"""By name: this module knows no stage. A module that cannot be imported there is left out."""


@dataclass(frozen=True)
class _TaskEnded:
    """A worker has sent everything of one task."""


def run_local(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task and yield its results as they come, in no particular order across tasks.

    With one worker everything happens in this process. More are forked from a server process that is started once, and
    does nothing but load what all of them need: so a stage's workers are there at once, and nothing is inherited from
    threads or libraries of this process, so results cannot depend on what it did before. Workers end when the generator
    is closed, and when this process ends, even if it is killed; the server ends with it.

    Args:
        tasks: must pickle, as must `work` and its results, when workers > 1.
        work: generator function of one task.
        workers: number of processes.

    Raises:
        WsmError: a task raised one, or a worker died.
        RuntimeError: a task in a worker raised anything else; the message is its traceback.
    """
    if workers <= 1 or len(tasks) <= 1:
        limit_threads()
        for task in tasks:
            yield from work(task)
        return
    yield from _run_pool(tasks, work, min(workers, len(tasks)))


def _run_pool(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    """One connection a worker, and one task at a time on it.

    A queue that all share would hang where a worker dies while it holds the queue's lock, and would lose what does
    not pickle. A connection ends with its worker, and says so.
    """
    pool: dict[Connection, BaseProcess] = {}
    waiting = iter(tasks)
    try:
        with _interrupts_held_back():
            for _ in range(workers):
                connection, process = _start(work)
                pool[connection] = process
        busy = [connection for connection in pool if _give_next(waiting, connection, pool[connection])]
        while busy:
            ready = wait(busy)
            for connection in [one for one in busy if one in ready]:
                with _death_named(pool[connection]):
                    result: ResultT | TaskFailed | _TaskEnded = connection.recv()
                if not isinstance(result, _TaskEnded):
                    yield unless_failed(result)
                elif not _give_next(waiting, connection, pool[connection]):
                    busy.remove(connection)
    finally:
        for process in pool.values():
            process.terminate()
        for connection, process in pool.items():
            process.join()
            connection.close()


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


def _give_next(waiting: Iterator[TaskT], connection: Connection, process: BaseProcess) -> bool:
    for task in waiting:
        with _death_named(process):
            connection.send(task)
        return True
    return False


@contextmanager
def _death_named(process: BaseProcess) -> Iterator[None]:
    """Turn the end of a connection into an error for a person."""
    try:
        yield
    except (EOFError, OSError) as error:
        process.join(_DEATH_WAIT_S)
        raise WsmError(
            f"a worker process died (exit code {process.exitcode}; -9 usually means that memory ran out, 1 that it "
            "could not start or send a result: its own message stands above); what was finished is kept: run the same "
            "command again, with fewer --workers if it recurs"
        ) from error


def _worker(work: Callable[[TaskT], Iterator[ResultT]], connection: Connection) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    limit_threads()
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
