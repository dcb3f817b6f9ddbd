"""A hand-held sequence, rendered once for all tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

from hand_held import HandHeld, write_hand_held

SEQUENCE = "rgbd_dataset_home"


@pytest.fixture(scope="session")
def hand_held(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, HandHeld]:
    """The source with the sequence in it, and what was written."""
    source = tmp_path_factory.mktemp("tum")
    return source, write_hand_held(source / SEQUENCE, frames=100)
