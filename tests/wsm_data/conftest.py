"""The document of the release format, for the tests of what writes it and of what reads it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def format_document() -> str:
    """docs/format.md."""
    return (Path(__file__).parents[2] / "docs" / "format.md").read_text()


@pytest.fixture(scope="session")
def words_of_table(format_document: str) -> Callable[[str], list[str]]:
    """The code words in the first column of the table below a heading of docs/format.md."""

    def words(heading: str) -> list[str]:
        section = format_document.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
        cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
        return [word for cell in cells for word in re.findall(r"`([^`]+)`", cell)]

    return words
