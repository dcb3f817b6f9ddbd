"""Batches of work as one array job on Slurm; knows no stage. Tested with submitit's local executor only."""

from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from pathlib import Path

import submitit

from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError

JOBS_FOLDER = Path("slurm-jobs")
"""Scripts, logs and results of the jobs, below the current folder, which every node must see; safe to delete."""

_TIME_LIMIT_MIN = 24 * 60
_POLL_S = 1.0


def run_slurm(
    tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int, cluster: str = "slurm"
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task in `workers` jobs of one array, each with every `workers`-th task.

    Results come back when a job ends: the progress bar moves in steps, and of a job that is killed nothing is known,
    so its tasks are done again by the next run. Partition, account, memory and a time limit other than 24 hours
    are taken by sbatch from its own variables (SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_MEM_PER_CPU,
    SBATCH_TIMELIMIT, ...). Every node must see the same folders under the same paths. When a job fails the others
    are waited for, so that what they did is kept; the failure is raised after that.

    Args:
        tasks: must pickle, as must `work` and its results.
        work: generator function of one task.
        workers: number of jobs; each takes one CPU.
        cluster: `slurm`, or `local` for submitit's stand-in on this machine.

    Raises:
        WsmError: a task raised one, or a job was killed.
        RuntimeError: a task raised anything else; the message is its traceback.
    """
    if not tasks:
        return
    executor = submitit.AutoExecutor(folder=JOBS_FOLDER, cluster=cluster)
    executor.update_parameters(name="wsm", cpus_per_task=1, timeout_min=_TIME_LIMIT_MIN)
    shares = [tasks[first::workers] for first in range(min(workers, len(tasks)))]
    jobs = executor.map_array(partial(_work_on, work), shares)
    failures: list[TaskFailed] = []
    try:
        for job in submitit.helpers.as_completed(jobs, poll_frequency=_POLL_S):
            results: Sequence[ResultT | TaskFailed] = _results(job)
            for result in results:
                if isinstance(result, TaskFailed):
                    failures.append(result)
                else:
                    yield result
        for failure in failures:
            unless_failed(failure)
    finally:
        for job in jobs:
            if not job.done():
                job.cancel()


def _work_on(work: Callable[[TaskT], Iterator[ResultT]], tasks: Sequence[TaskT]) -> list[ResultT | TaskFailed]:
    """Everything the tasks gave, up to the first failure: what was finished before it is kept."""
    limit_threads()
    results: list[ResultT | TaskFailed] = []
    for task in tasks:
        results += results_of(work, task)
        if results and isinstance(results[-1], TaskFailed):
            break
    return results


def _results(job: "submitit.Job[Sequence[ResultT | TaskFailed]]") -> Sequence[ResultT | TaskFailed]:
    try:
        results: Sequence[ResultT | TaskFailed] = job.result()
        return results
    except (submitit.core.utils.UncompletedJobError, submitit.core.utils.FailedJobError) as error:
        message = f"job {job.job_id} gave no result ({error}); logs are in {JOBS_FOLDER}. Run the same command again"
        return [TaskFailed(WsmError(message), "")]
