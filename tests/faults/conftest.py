"""The fake stages of the stage tests, for runs that are killed; the tiny release, for training that is killed."""

import sys
from collections import Counter
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent / "fakes"))
sys.path.insert(0, str(Path(__file__).parents[1] / "pipelines" / "fakes"))
sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from fake_runs import calls, config, fakes_on_path, out, source  # noqa: F401
from tiny_release import clips, make_clip, packed_tiny, tiny  # noqa: F401

PLANTED: Counter[str] = Counter()


@pytest.fixture
def faults():
    """Counts of what was planted, by kind; `make faults` prints them at its end."""
    return PLANTED


def pytest_terminal_summary(terminalreporter):
    for kind, count in sorted(PLANTED.items()):
        terminalreporter.write_line(f"planted: {count} {kind}")
