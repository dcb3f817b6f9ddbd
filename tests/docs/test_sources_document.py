"""The example of docs/sources.md runs, and what it writes goes to a verified release in one command."""

import re
import sys
from pathlib import Path

from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.readers.registry import READERS

sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from hand_held import CAMERA, walk_frames

ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs" / "sources.md").read_text()


def test_every_reader_is_described():
    assert re.findall(r"^## ([a-z]+)$", DOCUMENT, re.MULTILINE) == [reader.name for reader in READERS]


def test_the_example_writes_a_source_that_becomes_a_release(tmp_path, monkeypatch):
    (example,) = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)
    assert len([line for line in example.splitlines() if line.strip()]) <= 10
    monkeypatch.chdir(tmp_path)
    exec(example, {"my_recording": walk_frames(60), "my_K": CAMERA.matrix})  # noqa: S102 - our own text
    recipe = tmp_path / "short.toml"  # the recipe itself, up to the proof
    recipe.write_text((ROOT / "pipelines" / "recipes" / "arrays.toml").read_text().replace(', "score", "report"', ""))
    settings = ["source=my_source", "encode.clip.width=96", "encode.clip.height=64"]
    words = [word for setting in settings for word in ("--set", setting)]
    done = CliRunner().invoke(app, ["run", str(recipe), *words, "--out", "run", "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert "clips 1, findings 0" in done.output
