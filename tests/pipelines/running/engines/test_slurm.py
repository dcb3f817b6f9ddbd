"""The Slurm engine, through submitit's stand-in for a cluster on this machine."""

import os
from dataclasses import replace
from functools import partial

import pytest
from fake_stages import COPY, CopyConfig
from fake_tasks import die, fail_but_two, numbers_below, process_id, refuse

from pipelines.running.engines.slurm import run_slurm
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.errors import DataError, WsmError


@pytest.fixture
def run_here(tmp_path, monkeypatch, fakes_on_path):
    monkeypatch.chdir(tmp_path)  # where the jobs' folder is made
    monkeypatch.setenv("PYTHONPATH", fakes_on_path["PYTHONPATH"])
    return partial(run_slurm, cluster="local")


def test_every_result_arrives_once_from_as_many_jobs_as_workers(run_here, tmp_path):
    expected = sorted((task, number) for task in range(5) for number in range(task))
    assert sorted(run_here(list(range(5)), numbers_below, 2)) == expected
    assert len(list((tmp_path / "slurm-jobs").glob("*_submitted.pkl"))) == 2


def test_jobs_are_other_processes(run_here):
    ids = list(run_here([0, 1, 2], process_id, 2))
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


def test_a_job_that_dies_is_told_with_its_log(run_here, monkeypatch):
    monkeypatch.setattr("submitit.core.core.Job._results_timeout_s", 0)  # a cluster's file system may be 15 s late
    with pytest.raises(WsmError, match=r"(?s)job \d+ gave no result .*logs are in slurm-jobs"):
        list(run_here([1], die, 1))


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
