"""A LeRobot data set of colour alone goes to a verified release, and to training data, in one command."""

import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.release import open_release
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.readers.manifest import MANIFEST_FOLDER

sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from hand_held import CAMERA, walk_frames

RECIPE = Path(__file__).parents[2] / "pipelines" / "recipes" / "lerobot.toml"


def write_manifest(path):
    """The shipped one with what a user adds: the floor, the camera, and every frame."""
    text = (MANIFEST_FOLDER / "lerobot.toml").read_text()
    text = text.replace("min_step_m = 0.05", "min_step_m = 0.0\nfloor_z_m = 0.0").replace("min_turn_deg = 5.0", "")
    published = {"width": CAMERA.width, "height": CAMERA.height, "fx": CAMERA.fx, "fy": CAMERA.fy}
    published |= {"cx": CAMERA.cx, "cy": CAMERA.cy}
    path.write_text(f"{text}\n[cameras.camera]\n" + "\n".join(f"{name} = {value}" for name, value in published.items()))


def test_two_episodes_that_share_their_files_become_two_clips_without_depth(tmp_path):
    pytest.importorskip("av", reason="the extra lerobot is not installed")
    from lerobot_set import Walk, write_set

    walk = list(walk_frames(24))
    parts = [walk[:10], walk[10:]]
    walks = [
        Walk(**dict(zip(("rgb", "depth_m", "T_world_camera"), zip(*part, strict=True), strict=True))) for part in parts
    ]
    write_set(tmp_path / "walks", walks, version=3, depth=False)
    write_manifest(tmp_path / "mine.toml")
    recipe = tmp_path / "short.toml"  # the recipe itself, up to the proof
    recipe.write_text(RECIPE.read_text().replace(', "score", "report"', ""))
    settings = [f"source={tmp_path / 'walks'}", f"index.dataset={tmp_path / 'mine.toml'}", "split.test_fraction=0"]
    settings += ["encode.clip.width=96", "encode.clip.height=64"]
    words = [word for setting in settings for word in ("--set", setting)]
    done = CliRunner().invoke(app, ["run", str(recipe), *words, "--out", str(tmp_path / "run"), "--workers", "1"])
    assert done.exit_code == 0, done.output
    release = open_release(tmp_path / "run" / "pack" / "release")
    assert release.manifest.drops == {}
    for number, part in enumerate(parts):
        clip = release.read_clip(f"lerobot_camera/walks_{number:06d}/000000")
        assert not clip.has_depth
        T_world_camera0 = clip.meta.T_world_camera0_matrix
        positions = clip.poses[: len(part), :3] @ T_world_camera0[:3, :3].T + T_world_camera0[:3, 3]
        assert np.abs(positions - np.array([T[:3, 3] for _, _, T in part])).max() < 1e-5  # float32
    source = SourceConfig(release=str(tmp_path / "run" / "pack" / "release"))
    config = LoaderConfig(sources=(source,), order=OrderConfig(global_batch=2), depth=False)
    with ClipLoader(config, rank=0, world_size=1) as loader:
        assert next(iter(loader)).depth is None
