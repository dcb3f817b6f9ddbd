"""What the documentation says of reasons, settings and commands is what the code has."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.registry import STAGES
from wsm_data.errors import Reason
from wsm_data.synth.config import SynthConfig

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/pipeline.md")
WRITTEN = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md"))
LINK = re.compile(r"(?:(?<=\]\()|(?<=\]: ))[^()\s]+")


def test_every_reason_code_is_explained_and_no_other():
    refusals = (ROOT / "docs/pipeline.md").read_text().partition("## Refusals")[2]
    table = re.findall(r"^\| `([a-z_0-9]+\.[a-z_0-9]+)` \|", refusals, re.MULTILINE)
    assert sorted(table) == sorted(reason.value for reason in Reason)


def test_every_stage_is_in_the_tour():
    tour = (ROOT / "README.md").read_text()
    assert [entry.name for entry in STAGES if f"`wsm {entry.name}`" not in tour] == []


@pytest.mark.parametrize(
    "page",
    [
        *PAGES,
        "docs/loaders.md",
        "docs/closed_loop.md",
        "docs/sources.md",
        "docs/soundness.md",
        "docs/model.md",
        "docs/stores.md",
        "docs/cluster.md",
        "docs/posttraining.md",
    ],
)
def test_every_option_in_the_documentation_exists(page):
    text = (ROOT / page).read_text()
    options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))
    options -= {"--nproc-per-node", "--generate"}  # of torchrun, of ray
    commands = ("run", "status", "inspect", "view", "film", "verify", "select", "audit", "audit-run", "bench loader")
    commands += ("export tum", "clean", "retry", "export lerobot", "posttrain")
    commands += ("train", "eval nav", "eval slam", "serve", "source describe", "source miniworld", "check", "preflight")
    commands += ("publish", "fetch", "merge", "plan")
    commands += ("audit-latents", "eval clips", "dream", "model export", "model push")
    helped = "".join(CliRunner().invoke(app, [*command.split(), "--help"]).output for command in commands)
    assert options - {one for one in options if one in helped} == set()


@pytest.mark.parametrize("page", sorted(path.relative_to(ROOT).as_posix() for path in WRITTEN))
def test_every_relative_link_and_picture_exists(page):
    path = ROOT / page
    targets = {target.partition("#")[0] for target in LINK.findall(path.read_text())}
    local = {target for target in targets if target and "://" not in target}
    assert {target for target in local if not (path.parent / target).exists()} == set()


def test_the_pattern_finds_links_pictures_and_definitions():
    text = "see [a](docs/a.md#part) and ![b](docs/b.png)\n\n[c]: docs/c.md\n"
    assert LINK.findall(text) == ["docs/a.md#part", "docs/b.png", "docs/c.md"]


def test_clips_in_the_documentation_are_named_as_generated_scenes_are():
    named = {scene for page in PAGES for scene in re.findall(r"home_\d+", (ROOT / page).read_text())}
    assert named <= {SynthConfig().scene_name(index) for index in range(SynthConfig().scenes)}
    assert named
