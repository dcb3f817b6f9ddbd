"""Batches of work on a ray cluster; knows no stage. Tested with nodes on one machine, not with several machines."""

import logging
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import ray

from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError

_LOG = logging.getLogger(__name__)
_ATTEMPTS = 3
"""Of a task whose worker or node is lost; what a task raises itself is not tried again."""


@dataclass(frozen=True)
class _AtWork:
    """A task on the cluster, and how often it was begun."""

    index: int
    attempt: int


@contextmanager
def ray_session() -> Iterator[None]:
    """Be on a cluster for all stages of a run: starting one takes about as long as a small stage.

    Joins the cluster that RAY_ADDRESS names, or else one that runs on this machine, or else starts one here and stops
    it at the end. One that this process joined already is left as it is.
    """
    joined = ray.is_initialized()
    if not joined:
        ray.init(logging_level=logging.WARNING)
    try:
        yield
    finally:
        if not joined:
            ray.shutdown()


def run_ray(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task on ray and yield its results as they come, in no particular order across tasks.

    A task that is lost with its worker or node is begun again on another, so that results it had given before come
    again. All nodes must see the same input and output folders under the same paths.

    Args:
        tasks: must pickle, as must `work` and its results.
        work: generator function of one task.
        workers: tasks at work at once; each takes one of the cluster's CPUs.

    Raises:
        WsmError: a task raised one, or was lost three times.
        RuntimeError: a task raised anything else; the message is its traceback.
    """
    if not tasks:
        return
    with ray_session():
        yield from _run(tasks, work, workers)


def _run(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    remote = ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")(_stream)
    shared = ray.put(work)
    waiting = deque(_AtWork(index, 1) for index in range(len(tasks)))
    at_work: dict[Iterator[object], _AtWork] = {}
    try:
        while waiting or at_work:
            while waiting and len(at_work) < max(1, workers):
                begun = waiting.popleft()
                at_work[remote.remote(shared, tasks[begun.index])] = begun
            ready, _ = ray.wait(list(at_work), num_returns=1)
            for stream in ready:
                begun = at_work.pop(stream)
                try:
                    reference = next(stream, None)  # None where the stream has ended
                    if reference is None:
                        continue
                    result: ResultT | TaskFailed = ray.get(reference)
                except ray.exceptions.RayError as error:
                    waiting.append(_again(begun, error))
                    continue
                at_work[stream] = begun  # behind the others
                yield unless_failed(result)
    finally:
        for stream in at_work:
            ray.cancel(stream, force=True)


def _again(begun: _AtWork, error: Exception) -> _AtWork:
    """The next attempt of a task that was lost."""
    said = str(error).strip().partition("\n")[0]
    if begun.attempt == _ATTEMPTS:
        raise WsmError(
            f"ray lost the worker of one task {_ATTEMPTS} times, at last because: {said}; what was finished is kept. "
            "Where memory ran out, run the same command again with fewer --workers"
        ) from error
    _LOG.warning("ray lost the worker of a task (%s); it is begun again, attempt %d", said, begun.attempt + 1)
    return _AtWork(begun.index, begun.attempt + 1)


def _stream(work: Callable[[TaskT], Iterator[ResultT]], task: TaskT) -> Iterator[ResultT | TaskFailed]:
    limit_threads()
    for result in results_of(work, task):  # noqa: UP028 - ray sends values, which `yield from` would hand on to `work`
        yield result
