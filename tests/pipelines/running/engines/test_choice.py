"""Engines by name."""

import importlib.util
import shutil
from math import inf

import pytest

from pipelines.running.engines import ray as ray_engine
from pipelines.running.engines.choice import EngineName, opened
from pipelines.running.engines.local import run_local
from pipelines.running.engines.slurm import run_slurm
from pipelines.running.engines.slurm_config import SlurmConfig
from wsm_data.errors import ConfigError


def test_the_local_engine_is_always_there():
    with opened("local") as engine:
        assert (engine.func, engine.keywords) == (run_local, {"attempts": 3, "silence_s": inf})
    with opened("local", unit_timeout_s=60.0) as engine:
        assert engine.keywords["silence_s"] == 60.0


def test_units_are_timed_by_the_local_engine_alone():
    with pytest.raises(ConfigError, match="Slurm takes --slurm time_min=MINUTES"), opened("ray", unit_timeout_s=1.0):
        pass


def test_an_unknown_engine_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match="there is no engine 'spark'; engines: local, ray, slurm"), opened("spark"):
        pass


@pytest.mark.parametrize(("name", "package"), [(EngineName.RAY, "ray"), (EngineName.SLURM, "submitit")])
def test_a_missing_extra_is_named(monkeypatch, name, package):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ConfigError, match=rf"needs the package {package}: pip install 'wsm\[{name}\]'"), opened(name):
        pass


def test_slurm_is_refused_where_nothing_can_be_submitted(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: object())
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(ConfigError, match="run it on a login node"), opened("slurm"):
        pass


def test_slurm_gets_what_its_jobs_ask_for(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: "sbatch")
    with opened("slurm", SlurmConfig(partition="gpu")) as engine:
        assert engine.func is run_slurm
        assert engine.keywords == {"config": SlurmConfig(partition="gpu")}


def test_what_is_asked_of_slurm_is_no_word_for_another_engine():
    with pytest.raises(ConfigError, match="--slurm is for --engine slurm, found local"), opened("local", SlurmConfig()):
        pass


def test_ray_is_one_session_for_all_that_is_run_in_it(monkeypatch):
    calls = []
    monkeypatch.setattr(ray_engine.ray, "is_initialized", lambda: bool(calls))
    monkeypatch.setattr(ray_engine.ray, "init", lambda **_: calls.append("init"))
    monkeypatch.setattr(ray_engine.ray, "shutdown", lambda: calls.append("shutdown"))
    monkeypatch.setattr(ray_engine, "_run", lambda tasks, *_: iter(tasks))
    with opened("ray") as engine:
        assert [list(engine([stage], None, 1)) for stage in ("index", "map")] == [["index"], ["map"]]
        assert calls == ["init"]
    assert calls == ["init", "shutdown"]
