"""The fake stages of the stage tests, for runs that are killed."""

import os
import sys
from pathlib import Path

import pytest

FAKES = Path(__file__).parents[1] / "pipelines" / "fakes"
sys.path.insert(0, str(FAKES))


@pytest.fixture
def source(tmp_path):
    """Three good files."""
    folder = tmp_path / "source"
    folder.mkdir()
    for name in ("a1", "a2", "b1"):
        (folder / f"{name}.txt").write_text(f"text of {name}")
    return folder


@pytest.fixture
def calls(tmp_path):
    """What the fake stages did since the last time this was asked."""

    def read_and_forget() -> list[str]:
        path = tmp_path / "calls.txt"
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines

    return read_and_forget


@pytest.fixture
def fakes_on_path():
    """Environment of a subprocess that can import the fake stages."""
    path = [str(FAKES), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path))}
