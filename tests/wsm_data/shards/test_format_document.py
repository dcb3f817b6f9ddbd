"""docs/format.md says what the code does: its snippets run, and its tables list what there is."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from wsm_data.schema.clip import MEMBERS
from wsm_data.shards.findings import FindingKind
from wsm_data.shards.index_row import SCHEMA
from wsm_data.shards.inventory import InventoryRow
from wsm_data.shards.members import MEMBER_NAMES

DOCUMENT = (Path(__file__).parents[3] / "docs" / "format.md").read_text()
SNIPPETS = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)


def _first_cells(heading: str) -> list[str]:
    """The code words in the first column of the table below a heading."""
    section = DOCUMENT.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    return [word for cell in cells for word in re.findall(r"`([^`]+)`", cell)]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # webdataset leaves its file open
@pytest.mark.parametrize("number", range(len(SNIPPETS)))
def test_every_snippet_runs_beside_a_release(
    tiny: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.chdir(tiny.folder.parent)
    exec(compile(SNIPPETS[number], f"docs/format.md, snippet {number}", "exec"), {})  # noqa: S102 - our own document


def test_there_are_snippets() -> None:
    assert len(SNIPPETS) == 4


def test_the_table_of_members_is_that_of_the_schema() -> None:
    assert _first_cells("## A clip") == [*(f"{name}.npy" for name in MEMBERS), "meta.json"]
    for name, (dtype, axes) in MEMBERS.items():
        assert f"| `{name}.npy` | {dtype} | {', '.join(axes)} |" in DOCUMENT


def test_the_table_of_columns_is_that_of_the_index() -> None:
    listed: list[str] = []
    for word in _first_cells("## index.parquet"):
        listed += [word.replace("<member>", name) for name in MEMBER_NAMES] if "<member>" in word else [word]
    assert sorted(listed) == sorted(SCHEMA.names)


def test_the_table_of_keys_is_that_of_the_manifest(tiny: SimpleNamespace) -> None:
    record = json.loads((tiny.folder / "dataset.json").read_bytes())
    assert sorted(_first_cells("## dataset.json")) == sorted(record)


def test_the_table_of_findings_is_complete() -> None:
    assert sorted(_first_cells("## What `wsm verify` checks")) == sorted(FindingKind)


def test_the_columns_of_the_inventory_are_named() -> None:
    names = [f"`{name}`" for name in InventoryRow.__dataclass_fields__]
    assert f"columns {', '.join(names[:-1])} and {names[-1]}" in DOCUMENT
