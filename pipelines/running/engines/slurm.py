"""Batches of work as array jobs on Slurm, a job a task; knows no stage."""

import logging
import subprocess
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from pathlib import Path

import submitit

from pipelines.running.engines.slurm_config import SlurmConfig
from pipelines.running.engines.task import ResultT, TaskFailed, TaskT, limit_threads, results_of, unless_failed
from wsm_data.errors import WsmError

JOBS_FOLDER = Path("slurm-jobs")
"""Scripts, logs and results of the jobs, below the current folder, which every node must see; safe to delete."""

_LOG = logging.getLogger(__name__)
_POLL_S = 1.0
_LATE_S = 15.0
"""For so long the file system of a cluster may keep a result that a job has written to itself, s."""


def run_slurm(
    tasks: Sequence[TaskT],
    work: Callable[[TaskT], Iterator[ResultT]],
    workers: int,
    cluster: str = "slurm",
    config: SlurmConfig | None = None,
) -> Generator[ResultT, None, None]:
    """Apply `work` to every task in an array of jobs, of which `workers` run at the same time.

    Results come back as each job ends. Of a job that was killed, timed out or lost with its node nothing is known: its
    tasks are submitted again, each in a job of its own, once the others have ended. A task that raises is not; the
    others are waited for, so that what they did is kept, and its error is raised after that. Every node must see the
    same folders under the same paths. What `config` leaves open is taken by sbatch from its own variables
    (SBATCH_PARTITION, SBATCH_ACCOUNT, ...).

    Args:
        tasks: must pickle, as must `work` and its results.
        work: generator function of one task.
        workers: jobs at work at once.
        cluster: `slurm`, or `local` for submitit's stand-in on this machine, which runs as many as are submitted.
        config: what each job asks for, and how often a task is submitted.

    Raises:
        WsmError: a task raised one, or its job was lost in every attempt.
        RuntimeError: a task raised anything else; the message is its traceback.
    """
    config = config or SlurmConfig()
    lost = _shares(tasks, config.max_jobs)
    failures: list[TaskFailed] = []
    for attempt in range(1, config.attempts + 1):
        if not lost:
            break
        if attempt > 1:
            _LOG.warning("%d jobs were lost; their tasks are submitted again, attempt %d", len(lost), attempt)
            lost = _shares([task for share in lost for task in share], config.max_jobs)
        lost = yield from _submitted(lost, work, workers, cluster, config, failures)
    if lost:
        count = sum(map(len, lost))
        message = f"the jobs of {count} tasks gave no result in {config.attempts} attempts; logs are in {JOBS_FOLDER}"
        failures.append(TaskFailed(WsmError(f"{message}. Run the same command again"), ""))
    for failure in failures:
        unless_failed(failure)


def _shares(tasks: Sequence[TaskT], jobs: int) -> list[Sequence[TaskT]]:
    """The tasks for at most so many jobs: one each, where that is enough."""
    return [tasks[first::jobs] for first in range(min(jobs, len(tasks)))]


def _submitted(
    shares: Sequence[Sequence[TaskT]],
    work: Callable[[TaskT], Iterator[ResultT]],
    workers: int,
    cluster: str,
    config: SlurmConfig,
    failures: list[TaskFailed],
) -> Generator[ResultT, None, list[Sequence[TaskT]]]:
    """Yield the results of one array of jobs; returns the shares of those that gave none."""
    executor = submitit.AutoExecutor(folder=JOBS_FOLDER, cluster=cluster)
    executor.update_parameters(name="wsm", cpus_per_task=config.cpus, timeout_min=config.time_min)
    executor.update_parameters(slurm_array_parallelism=workers, **config.parameters())
    jobs = executor.map_array(partial(_work_on, work), shares)
    share_of = {job.job_id: share for job, share in zip(jobs, shares, strict=True)}
    lost: list[Sequence[TaskT]] = []
    waiting = dict.fromkeys(jobs)
    try:
        for job in _as_they_end(jobs, cluster):
            del waiting[job]
            results: Sequence[ResultT | TaskFailed] | None = _results(job)
            if results is None:
                lost.append(share_of[job.job_id])
            for result in results or ():
                if isinstance(result, TaskFailed):
                    failures.append(result)
                else:
                    yield result
    finally:
        for job in waiting:
            job.cancel(check=False)
    return lost


def _as_they_end(jobs: "Sequence[submitit.Job[object]]", cluster: str) -> "Iterator[submitit.Job[object]]":
    """Jobs as they give a result, or are gone from the queue without one.

    submitit asks sacct, which sites without accounting do not have: there a job that was killed is at work for ever.
    """
    waiting = list(jobs)
    gone_since: dict[str, float] = {}
    while waiting:
        queued = _queued() if cluster == "slurm" else {job.job_id for job in waiting if not job.done()}
        now = time.monotonic()
        for job in tuple(waiting):
            is_gone = queued is not None and job.job_id not in queued
            since = gone_since.setdefault(job.job_id, now) if is_gone else now
            if job.paths.result_pickle.exists() or (is_gone and now - since >= _LATE_S):
                waiting.remove(job)
                yield job
        if waiting:
            time.sleep(_POLL_S)


def _queued() -> set[str] | None:
    """Ids of the user's jobs that wait or run; None where nobody says."""
    command = ["squeue", "--me", "--noheader", "--array", "--format=%i"]
    asked = subprocess.run(command, capture_output=True, text=True, check=False)
    if asked.returncode:
        _LOG.warning("squeue does not say which jobs are left (%s); it is asked again", asked.stderr.strip())
        return None
    return set(asked.stdout.split())


def _work_on(work: Callable[[TaskT], Iterator[ResultT]], tasks: Sequence[TaskT]) -> list[ResultT | TaskFailed]:
    """Everything the tasks gave, up to the first failure: what was finished before it is kept."""
    limit_threads()
    results: list[ResultT | TaskFailed] = []
    for task in tasks:
        results += results_of(work, task)
        if results and isinstance(results[-1], TaskFailed):
            break
    return results


def _results(job: "submitit.Job[Sequence[ResultT | TaskFailed]]") -> Sequence[ResultT | TaskFailed] | None:
    """What a job gave; None where it was lost."""
    if job.paths.result_pickle.exists():
        try:
            results: Sequence[ResultT | TaskFailed] = job.result()
            return results
        except submitit.core.utils.FailedJobError as error:
            _LOG.warning("job %s failed: %s", job.job_id, error)
            return None
    _LOG.warning("job %s ended without a result; its log is in %s", job.job_id, JOBS_FOLDER)
    return None
