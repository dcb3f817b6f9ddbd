"""A tiny release, and the document of its format."""

import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from tiny_release import clips, make_clip, tiny  # noqa: F401


@pytest.fixture(scope="session")
def format_document() -> str:
    """docs/format.md."""
    return (Path(__file__).parents[3] / "docs" / "format.md").read_text()


@pytest.fixture(scope="session")
def words_of_table(format_document: str) -> Callable[[str], list[str]]:
    """The code words in the first column of the table below a heading of docs/format.md."""

    def words(heading: str) -> list[str]:
        section = format_document.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
        cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
        return [word for cell in cells for word in re.findall(r"`([^`]+)`", cell)]

    return words
