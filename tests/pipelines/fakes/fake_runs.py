"""Fixtures of tests that run the fake stages; a conftest imports those that the tests of its folder use."""

import os
from pathlib import Path

import pytest
from fake_stages import CALLS, CopyConfig

from pipelines.running.options import RunOptions

FAKES = Path(__file__).parent

ANY = RunOptions(quiet=True, max_refused=100)
"""However much is refused."""


@pytest.fixture
def source(tmp_path):
    """Three good files."""
    folder = tmp_path / "source"
    folder.mkdir()
    for name in ("a1", "a2", "b1"):
        (folder / f"{name}.txt").write_text(f"text of {name}")
    return folder


@pytest.fixture
def config(source):
    """Settings of `copy` over the three files."""
    return CopyConfig(source=source)


@pytest.fixture
def out(tmp_path):
    """The folder of `copy` in a run folder."""
    return tmp_path / "run" / "copy"


@pytest.fixture
def calls(tmp_path):
    """What the fake stages did since the last time this was asked."""

    def read_and_forget() -> list[str]:
        path = tmp_path / CALLS
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines

    return read_and_forget


@pytest.fixture
def fakes_on_path():
    """Environment of a subprocess that can import the fake stages."""
    return environment()


def environment():
    """Environment of a subprocess that can import the fake stages."""
    path = [str(FAKES), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path))}


def copies(out):
    """What `copy` wrote, by unit."""
    return {path.stem: path.read_text() for path in (out / "copies").glob("*.txt")}
