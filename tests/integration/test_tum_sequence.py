"""A hand-held sequence goes from disk to a verified release in one command."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.release import open_release

sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from hand_held import write_hand_held

RECIPE = Path(__file__).parents[2] / "pipelines" / "recipes" / "tum.toml"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    root = tmp_path_factory.mktemp("tum")
    truth = write_hand_held(root / "source" / "rgbd_dataset_home", frames=100)
    settings = [f"source={root / 'source'}", "encode.clip.width=96", "encode.clip.height=64"]
    words = [word for setting in settings for word in ("--set", setting)]
    recipe = root / "short.toml"  # the recipe itself, up to the proof
    recipe.write_text(RECIPE.read_text().replace(', "score", "report"', ""))
    done = CliRunner().invoke(app, ["run", str(recipe), *words, "--out", str(root / "run"), "--workers", "1"])
    assert done.exit_code == 0, done.output
    return root / "run", truth


def test_nothing_is_refused_and_the_release_is_verified(run):
    out, _ = run
    for stage in ("index", "map", "encode", "pack", "verify"):
        quarantine = out / stage / "quarantine.jsonl"
        assert not quarantine.exists() or quarantine.read_text() == "", stage
    assert json.loads((out / "pack" / "release" / "dataset.json").read_text())["name"] == "tum-rgbd"


def test_the_clip_has_the_true_way_and_the_camera_at_its_own_size(run):
    out, truth = run
    clip = open_release(out / "pack" / "release").read_clip("tum_rgbd_own/rgbd_dataset_home/000000")
    frames = clip.meta.frames - clip.meta.padded_frames
    T_world_camera0 = np.array(clip.meta.T_world_camera0)
    assert np.abs(T_world_camera0 - truth.T_world_camera[0]).max() < 2e-5  # six digits in the file
    positions = clip.poses[:frames, :3] @ T_world_camera0[:3, :3].T + T_world_camera0[:3, 3]
    gaps_m = np.linalg.norm(positions[:, None] - truth.T_world_camera[None, :, :3, 3], axis=2).min(axis=1)
    assert gaps_m.max() < 1e-4
    assert clip.meta.intrinsics.fx == pytest.approx(160 * 96 / 160)
    assert clip.meta.intrinsics.fy == pytest.approx(161 * 64 / 120)
