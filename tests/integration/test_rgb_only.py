"""A source without depth goes to a release that is verified, scored, shown and trained on: by a model without depth."""

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.training.config import HeldOutConfig, ModelChoice, TrainRunConfig
from pipelines.training.pretrain import run_training
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.readers.arrays import write_episode
from wsm_data.schema.occupancy import FREE, OCCUPIED
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.training.config import TrainingConfig

sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from hand_held import CAMERA, walk_frames

RGB_ONLY, WITH_DEPTH = "arrays_cam/home/bare", "arrays_cam/den/full"


def invoke(*words):
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    root = tmp_path_factory.mktemp("source")
    walk = list(walk_frames(60))
    bare = ((rgb, None, T) for rgb, _, T in walk)
    write_episode(root, "home", "bare", bare, K=CAMERA.matrix, camera="cam", floor_z_m=0.0)
    write_episode(root, "den", "full", walk, K=CAMERA.matrix, camera="cam", floor_z_m=0.0)
    return root


def build(source, out):
    settings = ["split.test_fraction=0", "encode.clip.width=96", "encode.clip.height=64", "encode.quality_share=1"]
    words = [word for setting in (f"source={source}", *settings) for word in ("--set", setting)]
    invoke("run", "arrays", *words, "--out", out, "--workers", "1")
    return out / "pack" / "release"


@pytest.fixture(scope="module")
def release(source, tmp_path_factory):
    return build(source, tmp_path_factory.mktemp("run"))


def test_the_clip_has_no_depth_and_a_map_of_what_the_footprint_swept(release):
    clip = open_release(release).read_clip(RGB_ONLY)
    assert (clip.depth_latent, clip.depth_valid, clip.meta.map_from) == (None, None, "path")
    assert list(clip.arrays()) == ["rgb_latent", "poses", "occupancy", "geodesic_mm", "expert_distance"]
    free = clip.occupancy == FREE
    assert not (clip.occupancy == OCCUPIED).any()
    assert free.sum() == clip.meta.freed_cells
    radius_m, steps = clip.meta.robot_radius_m, np.linalg.norm(np.diff(clip.poses[:, :3], axis=0), axis=1)
    swept_m2 = steps.sum() * 2 * radius_m + np.pi * radius_m**2
    assert free.sum() * clip.meta.map_resolution_m**2 <= 1.1 * swept_m2
    assert clip.expert_distance[-1] == 0


def test_verify_inspect_and_score_say_that_there_is_no_depth(release, tmp_path):
    assert "is whole" in invoke("verify", release)
    assert "the clip has no depth" in invoke("inspect", release, RGB_ONLY, "--out", tmp_path / "clip.png")
    scores = pq.read_table(release / "scores.parquet", columns=["key", "depth_invalid_share"]).to_pydict()
    shares = dict(zip(scores["key"], scores["depth_invalid_share"], strict=True))
    assert shares[RGB_ONLY] is None
    assert 0 <= shares[WITH_DEPTH] <= 1


def test_batches_without_depth_are_those_of_any_clip_and_batches_with_depth_say_which_clip_has_none(release):
    order = OrderConfig(shuffle=False, global_batch=2)
    config = LoaderConfig(sources=(SourceConfig(release=str(release)),), order=order, depth=False)
    with ClipLoader(config, rank=0, world_size=1) as loader:
        batch = next(iter(loader))
    assert batch.depth is None
    assert batch.depth_valid is None
    opened = open_release(release)
    standard = latent_standard(opened.manifest)
    mean, std = (np.array(one, np.float32)[:, None, None] for one in (standard.rgb_mean, standard.rgb_std))
    for row, key in enumerate(batch.keys):
        clip = opened.read_clip(key)
        wanted = (clip.rgb_latent.astype(np.float32) - mean) / std
        assert np.abs(batch.rgb[row, : clip.latent_count].numpy() - wanted).max() < 1e-5
        assert np.array_equal(batch.poses[row, : clip.latent_count].reshape(-1, 7)[3:].numpy(), clip.poses)
    with pytest.raises(ConfigError, match=rf"1 of 2 without, the first is {RGB_ONLY}.*depth = false"):
        ClipLoader(LoaderConfig(sources=config.sources, order=order), rank=0, world_size=1)


def test_the_model_without_slam_trains_on_it_and_the_one_with_slam_says_why_it_cannot(release, tmp_path):
    def run(variant):
        config = TrainRunConfig(
            sources=(SourceConfig(release=str(release)),),
            order=OrderConfig(global_batch=2, max_latents=4),
            model=ModelChoice(size="tiny", variant=variant),
            training=TrainingConfig(max_steps=2, sample_every=0),
            held_out=HeldOutConfig(clips=0),
        )
        return run_training(config, tmp_path / variant.value, quiet=True)

    run(Variant.IDM)
    assert (tmp_path / "idm" / "model").is_dir()
    with pytest.raises(ConfigError, match="variant `idm`"):
        run(Variant.SLAM)


def test_a_release_of_colour_alone_is_whole_too(tmp_path):
    bare = ((rgb, None, T) for rgb, _, T in walk_frames(60))
    write_episode(tmp_path / "source", "home", "bare", bare, K=CAMERA.matrix, camera="cam", floor_z_m=0.0)
    release = build(tmp_path / "source", tmp_path / "run")
    opened = open_release(release)
    assert opened.manifest.depth_statistics.count == 0
    assert "is whole" in invoke("verify", release)
