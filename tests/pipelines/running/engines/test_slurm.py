"""The Slurm engine, through submitit's stand-in for a cluster on this machine."""

import os
import subprocess
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest
from fake_stages import COPY, CopyConfig
from fake_tasks import die_at_one, die_once, fail_but_two, numbers_below, process_id, refuse

from pipelines.running.engines import slurm
from pipelines.running.engines.slurm import run_slurm
from pipelines.running.engines.slurm_config import SlurmConfig
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.errors import DataError, WsmError


@pytest.fixture
def run_here(tmp_path, monkeypatch, fakes_on_path):
    monkeypatch.chdir(tmp_path)  # where the jobs' folder is made
    monkeypatch.setenv("PYTHONPATH", fakes_on_path["PYTHONPATH"])
    return partial(run_slurm, cluster="local")


def test_every_result_arrives_once_from_a_job_a_task(run_here, tmp_path):
    expected = sorted((task, number) for task in range(4) for number in range(task))
    assert sorted(run_here(list(range(4)), numbers_below, 2)) == expected
    assert len(list((tmp_path / "slurm-jobs").glob("*_submitted.pkl"))) == 4


def test_tasks_beyond_the_jobs_of_an_array_share_them(run_here):
    ids = list(run_here([0, 1, 2], process_id, 2, config=SlurmConfig(max_jobs=2)))
    assert len(ids) == 3
    assert len(set(ids)) == 2
    assert os.getpid() not in ids


def test_nothing_to_do_submits_nothing(run_here, tmp_path):
    assert list(run_here([], numbers_below, 2)) == []
    assert not (tmp_path / "slurm-jobs").exists()


def test_a_foreseen_error_of_a_job_arrives_whole(run_here):
    with pytest.raises(DataError, match="seven is bad"):
        list(run_here([7], refuse, 1))


def test_a_failing_job_gives_its_traceback_after_what_the_others_did(run_here):
    results = []
    with pytest.raises(RuntimeError, match=r"(?s)in fail_but_two\n.*ZeroDivisionError"):
        results.extend(collect(run_here([1, 2], fail_but_two, 2), results))
    assert sorted(results) == [1, 2]


def collect(generator, results):
    for result in generator:
        results.append(result)
    return ()


@pytest.fixture
def no_wait(monkeypatch):
    monkeypatch.setattr(slurm, "_LATE_S", 0.0)  # a cluster's file system may be late, this machine's is not


def test_a_job_that_dies_each_time_is_told_after_what_the_others_did(run_here, no_wait):
    results = []
    with pytest.raises(WsmError, match=r"(?s)jobs of 1 tasks gave no result in 2 attempts; logs are in slurm-jobs"):
        collect(run_here([0, 1], die_at_one, 2, config=SlurmConfig(attempts=2)), results)
    assert results == [0]


def test_what_a_lost_job_had_to_do_is_submitted_again_and_nothing_else(run_here, no_wait, tmp_path):
    found = list(run_here([str(tmp_path / "a"), str(tmp_path / "b")], die_once, 2))
    assert set(found) == {(str(tmp_path / name), number) for name in "ab" for number in range(2)}
    assert len(list((tmp_path / "slurm-jobs").glob("*_submitted.pkl"))) == 4


def test_a_stage_writes_the_same_bytes_as_with_local_processes(run_here, source, tmp_path):
    (source / "a3.txt").write_text("bad")
    options = RunOptions(quiet=True, max_refused=5, workers=2)
    local, slurm = tmp_path / "local", tmp_path / "slurm"
    for out, engine in ((local, None), (slurm, run_here)):
        run_stage(COPY, CopyConfig(source=source), out, options, *([engine] if engine else []))
    for name in ("copies/a1.txt", "copies/a2.txt", "copies/b1.txt", "words.json"):
        assert (slurm / name).read_bytes() == (local / name).read_bytes()
    assert {unit: replace(entry.outcome, seconds=0, facts={}) for unit, entry in read_ledger(slurm).items()} == {
        unit: replace(entry.outcome, seconds=0, facts={}) for unit, entry in read_ledger(local).items()
    }


def test_a_job_that_is_gone_from_the_queue_is_lost_also_where_there_is_no_accounting(monkeypatch, no_wait, tmp_path):
    """Two jobs of Slurm: one is at work until it has a result, the other was cancelled."""
    monkeypatch.setattr(slurm, "_POLL_S", 0.0)
    jobs = [
        SimpleNamespace(job_id=f"7_{one}", paths=SimpleNamespace(result_pickle=tmp_path / str(one))) for one in "ab"
    ]
    answers = [subprocess.CompletedProcess([], 1, "", "no answer"), *(done("7_a") for _ in range(2)), done("")]

    def asked(command, **_):
        assert command[0] == "squeue"
        if len(answers) == 2:
            (tmp_path / "a").touch()
        return answers.pop(0)

    monkeypatch.setattr(subprocess, "run", asked)
    assert [job.job_id for job in slurm._as_they_end(jobs, "slurm")] == ["7_b", "7_a"]
    assert len(answers) == 1


def done(said):
    return subprocess.CompletedProcess([], 0, said, "")
