"""What the documentation says of reasons, settings and commands is what the code has."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.registry import STAGES
from wsm_data.errors import Reason

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/pipeline.md")


def test_every_reason_code_is_explained_and_no_other():
    refusals = (ROOT / "docs/pipeline.md").read_text().partition("## Refusals")[2]
    table = re.findall(r"^\| `([a-z_0-9]+\.[a-z_0-9]+)` \|", refusals, re.MULTILINE)
    assert sorted(table) == sorted(reason.value for reason in Reason)


def test_every_stage_is_in_the_tour():
    tour = (ROOT / "README.md").read_text()
    assert [entry.name for entry in STAGES if f"`wsm {entry.name}`" not in tour] == []


@pytest.mark.parametrize("page", PAGES)
def test_every_option_in_the_documentation_exists(page):
    text = (ROOT / page).read_text()
    options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))
    helped = "".join(CliRunner().invoke(app, [name, "--help"]).output for name in ("run", "inspect", "verify"))
    assert options - {one for one in options if one in helped} == set()
