"""Engines by name."""

import importlib.util
import shutil

import pytest

from pipelines.running.engines.choice import EngineName, engine
from pipelines.running.engines.local import run_local
from wsm_data.errors import ConfigError


def test_the_local_engine_is_always_there():
    assert engine("local") is run_local


def test_an_unknown_engine_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match="there is no engine 'spark'; engines: local, ray, slurm"):
        engine("spark")


@pytest.mark.parametrize(("name", "package"), [(EngineName.RAY, "ray"), (EngineName.SLURM, "submitit")])
def test_a_missing_extra_is_named(monkeypatch, name, package):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ConfigError, match=rf"needs the package {package}: pip install 'wsm\[{name}\]'"):
        engine(name)


def test_slurm_is_refused_where_nothing_can_be_submitted(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: object())
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(ConfigError, match="run it on a login node"):
        engine("slurm")


@pytest.mark.parametrize("name", [EngineName.RAY, EngineName.SLURM])
def test_an_installed_engine_is_found(monkeypatch, name):
    monkeypatch.setattr(shutil, "which", lambda _: "sbatch")
    assert engine(name).__module__ == f"pipelines.running.engines.{name}"
