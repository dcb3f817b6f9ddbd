"""The tables of docs/loaders.md on batches and reading name what the code has, and its example runs."""

import re
from dataclasses import fields
from pathlib import Path

import pytest
import torch

from wsm_data.loaders.batches.batch import layout_of
from wsm_data.loaders.config import ReadConfig
from wsm_data.schema.batch import ClipBatch

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "loaders.md").read_text()


def _section(page: str, heading: str) -> str:
    return page.split(f"\n{heading}\n", 1)[1].split("\n## ", 1)[0]


def _rows(heading: str) -> list[list[str]]:
    lines = [line for line in _section(PAGE, heading).splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_field_of_a_batch_stands_in_the_table_in_order():
    named = [name for row in _rows("## Batches") for name in re.findall(r"`(\w+)`", row[0])]
    in_text = [name for name in named if name in {field.name for field in fields(ClipBatch)}]
    assert in_text == named
    assert set(named) == {field.name for field in fields(ClipBatch)}


def test_dtypes_in_the_table_are_those_of_the_tensors():
    places = layout_of(1, 1, 1, (1, 1, 1), torch.float32).tensors
    for names, dtype, _ in _rows("## Batches"):
        for name in re.findall(r"`(\w+)`", names):
            if name in places and name not in ("rgb", "depth"):
                assert dtype.startswith(str(places[name].dtype).removeprefix("torch.")), name


def test_every_setting_of_the_table_exists():
    named = {name for row in _rows("## Reading") for name in re.findall(r"`(\w+)`", row[0])}
    assert named <= {field.name for field in fields(ReadConfig)}


@pytest.mark.parametrize(
    ("page", "heading"), [("docs/loaders.md", "## Batches"), ("README.md", "## Training from a release")]
)
def test_the_example_runs_as_written(released, page, heading, tmp_path, monkeypatch, capsys):
    released.copied(tmp_path / "runs/demo/pack/release")
    monkeypatch.chdir(tmp_path)
    code = re.search(r"```python\n(.*?)```", _section((ROOT / page).read_text(), heading), re.DOTALL).group(1)
    exec(compile(code, page, "exec"), {})  # noqa: S102
    assert len(re.findall(r"torch\.Size\(\[4, \d, 48, 6, 10\]\)", capsys.readouterr().out)) >= len(released.clips) // 4
