"""wsm eval slam, of a system that knows the truth, of one that shifts it, and of a model."""

import json
import shutil

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
import torch
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.evaluating.slam_sequence import Reconstruction, read_reconstruction, write_reconstruction
from pipelines.training.config import TrainRunConfig
from pipelines.training.data import model_config
from wsm_data.access.release import open_release
from wsm_data.loaders.config import SourceConfig
from wsm_data.maps.arrays_file import save_arrays
from wsm_data.metrics.tum import StampedTrajectory
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import ModelCard, save_model


@pytest.fixture(scope="module")
def release(homes_release) -> str:
    return str(homes_release)


def wsm(*words):
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def model(release, tmp_path_factory):
    """A model that learnt nothing."""
    out = tmp_path_factory.mktemp("model")
    manifest = open_release(release).manifest
    shape = model_config(TrainRunConfig(sources=(SourceConfig(release=release, split="train"),)), manifest)
    torch.manual_seed(0)
    card = ModelCard(config=shape, standard=latent_standard(manifest), releases=(), steps=0)
    save_model(out, WorldSlamModel(shape), card)
    return out


@pytest.fixture(scope="module")
def evaluated(release, model, tmp_path_factory):
    out = tmp_path_factory.mktemp("slam")
    code, text = wsm("eval", "slam", release, "--model", model, "--out", out, "--quiet")
    assert code == 0, text
    return out


def summary(out):
    return json.loads((out / "summary.json").read_text())


def test_a_model_is_evaluated_from_its_pictures_alone(evaluated):
    found = summary(evaluated)
    rows = pq.read_table(evaluated / "sequences.parquet").to_pylist()
    assert found["sequences"] == len(rows) > 0
    assert found["inputs"] == ["rgb"]
    scenes = {row["scene"] for row in rows}
    means = [np.mean([row["ate_rmse_unaligned_m"] for row in rows if row["scene"] == one]) for one in scenes]
    assert found["ate_rmse_unaligned_m"]["value"] == pytest.approx(np.mean(means))  # each scene counts once
    assert found["ate_rmse_sim3_m"] is None  # it says that it never moved: centres on a point cannot be aligned
    assert found["refused"] == {"trajectory.degenerate": len(rows)}
    for row in rows:
        assert read_reconstruction(evaluated / "sequences" / row["key"] / "estimated").trajectory.stamps_s[0] == 0


def moved(evaluated, folder, change):
    for path in (evaluated / "sequences").rglob("true/trajectory.txt"):
        key = path.parent.parent.relative_to(evaluated / "sequences")
        write_reconstruction(folder / key, change(read_reconstruction(path.parent)))
    return folder


def test_the_truth_itself_has_no_error(release, evaluated, tmp_path):
    moved(evaluated, tmp_path / "estimates", lambda one: one)
    code, text = wsm("eval", "slam", release, "--estimates", tmp_path / "estimates", "--out", tmp_path / "o", "--quiet")
    assert code == 0, text
    assert summary(tmp_path / "o")["inputs"] is None
    for name in ("ate_rmse_sim3_m", "ate_rmse_unaligned_m", "acc_rmse_m", "comp_mean_m"):
        assert summary(tmp_path / "o")[name]["value"] < 1e-5  # rounding of nine decimals and of float32 points


def test_keyframes_of_another_scale_under_other_names_are_aligned(release, evaluated, tmp_path):
    """As SLAM-Former leaves them: every third frame, twice as large, 1 m aside, in its own files."""

    def other(one):
        poses = one.trajectory.T_world_camera[::3].copy()
        poses[:, :3, 3] = 2 * poses[:, :3, 3] + [1.0, 0, 0]
        trajectory = StampedTrajectory(stamps_s=one.trajectory.stamps_s[::3].copy(), T_world_camera=poses)
        points = (2 * one.cloud.xyz_m + np.float32([1.0, 0, 0])).astype(np.float32)
        return Reconstruction(trajectory=trajectory, cloud=PointCloud(xyz_m=points, rgb_u8=one.cloud.rgb_u8))

    folder = moved(evaluated, tmp_path / "estimates", other)
    for path in list(folder.rglob("trajectory.txt")):
        shutil.move(path, path.with_name("final_traj.txt"))
        shutil.move(path.with_name("cloud.ply"), path.with_name("final.ply"))
    code, text = wsm("eval", "slam", release, "--estimates", folder, "--out", tmp_path / "o", "--quiet")
    assert code == 0, text
    found = summary(tmp_path / "o")
    assert found["ate_rmse_sim3_m"]["value"] < 1e-5
    assert found["acc_rmse_m"]["value"] < 1e-4
    assert found["ate_rmse_unaligned_m"]["value"] > 0.5


def test_points_of_keyframes_are_read_where_no_cloud_was_joined_from_them(release, evaluated, tmp_path):
    folder = moved(evaluated, tmp_path / "estimates", lambda one: one)
    for path in list(folder.rglob("cloud.ply")):
        cloud, points = read_reconstruction(path.parent).cloud, path.with_name("final_pc")
        path.unlink()
        for number, chosen in enumerate(np.array_split(np.arange(len(cloud.xyz_m)), 3)):
            mask = np.ones((1, len(chosen) + 1), bool)
            mask[0, -1] = False  # its point is not to be counted
            xyz = np.concatenate([cloud.xyz_m[chosen], np.float32([[9, 9, 9]])])[None]
            colours = np.concatenate([cloud.rgb_u8[chosen], np.uint8([[0, 0, 0]])])[None] / 255
            save_arrays(points / f"{4 * number}.npz", {"pointcloud": xyz, "mask": mask, "color": colours})
    code, text = wsm("eval", "slam", release, "--estimates", folder, "--out", tmp_path / "o", "--quiet")
    assert code == 0, text
    assert summary(tmp_path / "o")["acc_rmse_m"]["value"] < 1e-5
    one = next(folder.rglob("final_pc")).parent
    truth = evaluated / "sequences" / one.relative_to(folder) / "true"
    np.testing.assert_array_equal(read_reconstruction(one).cloud.rgb_u8, read_reconstruction(truth).cloud.rgb_u8)


def test_each_sequence_has_a_picture_of_its_ways(evaluated):
    for row in pq.read_table(evaluated / "sequences.parquet").to_pylist():
        assert cv2.imread(str(evaluated / "sequences" / row["key"] / "paths.png")).shape == (640, 720, 3)


def test_a_sequence_without_an_estimate_is_refused_by_its_folder(release, tmp_path):
    code, _ = wsm("eval", "slam", release, "--estimates", tmp_path, "--out", tmp_path / "o", "--quiet")
    assert code == 1
    assert not (tmp_path / "o" / "summary.json").exists()


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--model", "m", "--estimates", "e"],
        ["--estimates", "e", "--split", "none"],
        ["--estimates", "e", "--seed", "-1"],
    ],
)
def test_requests_that_say_too_little_or_too_much_are_refused(release, tmp_path, words):
    code, _ = wsm("eval", "slam", release, *words, "--out", tmp_path / "o")
    assert code == 2
