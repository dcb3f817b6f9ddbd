"""Batches of work on a ray cluster; knows no stage. Tested with ray's own cluster on one machine, not with several."""

import logging
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager

import ray

from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError


def run_ray(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task on ray and yield its results as they come, in no particular order across tasks.

    Joins the cluster that RAY_ADDRESS names, or else one that runs on this machine, or else starts one here and stops
    it at the end. All nodes must see the same input and output folders under the same paths.

    Args:
        tasks: must pickle, as must `work` and its results.
        work: generator function of one task.
        workers: tasks at work at once; each takes one of the cluster's CPUs.

    Raises:
        WsmError: a task raised one, or a worker died.
        RuntimeError: a task raised anything else; the message is its traceback.
    """
    if not tasks:
        return
    joined = ray.is_initialized()
    if not joined:
        ray.init(logging_level=logging.WARNING)
    try:
        yield from _run(tasks, work, workers)
    finally:
        if not joined:
            ray.shutdown()


def _run(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int
) -> Generator[ResultT, None, None]:
    remote = ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")(_stream)
    shared = ray.put(work)
    waiting = deque(tasks)
    at_work: list[Iterator[object]] = []
    try:
        while waiting or at_work:
            while waiting and len(at_work) < max(1, workers):
                at_work.append(remote.remote(shared, waiting.popleft()))
            ready, at_work = ray.wait(at_work, num_returns=1)
            for stream in ready:
                with _loss_named():
                    reference = next(stream, None)  # None where the stream has ended
                    if reference is None:
                        continue
                    result: ResultT | TaskFailed = ray.get(reference)
                at_work.append(stream)
                yield unless_failed(result)
    finally:
        for stream in at_work:
            ray.cancel(stream, force=True)


@contextmanager
def _loss_named() -> Iterator[None]:
    """Turn what ray raises into an error for a person."""
    try:
        yield
    except ray.exceptions.RayError as error:
        raise WsmError(
            f"ray lost a worker or a result ({error}); what was finished is kept: run the same command again"
        ) from error


def _stream(work: Callable[[TaskT], Iterator[ResultT]], task: TaskT) -> Iterator[ResultT | TaskFailed]:
    limit_threads()
    for result in results_of(work, task):  # noqa: UP028 - ray sends values, which `yield from` would hand on to `work`
        yield result
