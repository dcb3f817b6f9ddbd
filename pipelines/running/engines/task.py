"""A task as every engine runs it: its results one by one, and its failure as a last value that can travel."""

import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from wsm_data.errors import WsmError

TaskT = TypeVar("TaskT")
ResultT = TypeVar("ResultT")


@dataclass(frozen=True)
class TaskFailed:
    """A task raised: a foreseen error travels whole, a bug as its traceback."""

    error: WsmError | None
    trace: str


def results_of(work: Callable[[TaskT], Iterator[ResultT]], task: TaskT) -> Iterator[ResultT | TaskFailed]:
    """Results of one task; where it raises, the last one is a `TaskFailed`."""
    try:
        yield from work(task)
    except WsmError as error:
        yield TaskFailed(error, "")
    except Exception:  # noqa: BLE001 - a bug must reach the parent with its traceback instead of a silent death
        yield TaskFailed(None, traceback.format_exc())


def unless_failed(result: ResultT | TaskFailed) -> ResultT:
    """The result, where it is one.

    Raises:
        WsmError: the task raised it.
        RuntimeError: the task raised anything else; the message is its traceback.
    """
    if isinstance(result, TaskFailed):
        raise result.error or RuntimeError(f"a worker failed:\n{result.trace}")
    return result


def limit_threads() -> None:
    """One thread per process for OpenCV and BLAS: processes are the parallelism, and sums do not depend on cores."""
    import cv2  # loaded here so that the command line stays light
    from threadpoolctl import threadpool_limits

    cv2.setNumThreads(1)
    threadpool_limits(limits=1)
