"""A LeRobot data set appears whole, or not at all."""

import json
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from pipelines.operations.clips import export_lerobot as operation
from pipelines.operations.clips.export_lerobot import export_lerobot
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError

pytest.importorskip("av", reason="the extra lerobot is not installed")
sys.path.insert(0, str(Path(__file__).parents[3] / "wsm_data" / "fakes"))

from walled_release import UNITS, build_release


@pytest.fixture(scope="module")
def walled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walled")
    build_release(folder, UNITS)
    return folder / "release"


def test_the_first_clips_of_a_split_become_episodes_in_its_order(walled, tmp_path, capsys):
    out = tmp_path / "a" / "set"
    export_lerobot(str(walled), out, "train", 2, "")
    keys = open_release(walled).keys(split="train")
    assert capsys.readouterr().out == f"2 of {len(keys)} clips: {out}\n"
    episodes = pq.read_table(out / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    assert episodes["clip_key"].to_pylist() == keys[:2]
    assert json.loads((out / "meta" / "info.json").read_text())["splits"] == {"train": "0:2"}
    assert [path.name for path in out.parent.iterdir()] == ["set"]


def test_a_folder_with_anything_in_it_is_refused_and_left_as_it_was(walled, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError, match="must not be there, or be an empty folder"):
        export_lerobot(str(walled), tmp_path, "", 1, "")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_what_fails_on_the_way_leaves_nothing(walled, tmp_path, monkeypatch):
    def fail(self, clip, decoded):
        raise OSError("no room")

    monkeypatch.setattr(operation.LerobotWriter, "add", fail)
    with pytest.raises(OSError, match="no room"):
        export_lerobot(str(walled), tmp_path / "set", "", 1, "")
    assert list(tmp_path.iterdir()) == []
