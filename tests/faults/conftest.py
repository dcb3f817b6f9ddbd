"""The fake stages of the stage tests, for runs that are killed."""

import os
import sys
from pathlib import Path

import pytest

FAKES = Path(__file__).parents[1] / "pipelines" / "fakes"
sys.path.insert(0, str(FAKES))


@pytest.fixture
def fakes_on_path():
    """Environment of a subprocess that can import the fake stages."""
    path = [str(FAKES), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path))}
