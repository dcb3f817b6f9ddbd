"""`wsm check` on sources of every reader."""

import json
import shutil

import numpy as np
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.readers.arrays import write_episode


def check(*words):
    return CliRunner(env={"GITHUB_ACTIONS": ""}).invoke(app, ["check", *map(str, words), "--workers", "1", "--quiet"])


def looking_at_a_corner(folder, *, still=False):
    """A camera 1 m over a floor, 45 degrees down, that goes 0.1 m a frame along y and sees squares on the floor.

    Depth of a floor without end is the same in every frame.
    """
    K = np.array([[96.0, 0, 63.5], [0, 96.0, 47.5], [0, 0, 1]])
    s = np.sqrt(0.5)
    rays = np.stack([*np.meshgrid((np.arange(128) - 63.5) / 96, (np.arange(96) - 47.5) / 96), np.ones((96, 128))], -1)

    def frames():
        for i in range(10):
            T = np.array([[1.0, 0, 0, 0], [0, -s, s, 0.1 * (0 if still else i)], [0, -s, -s, 1], [0, 0, 0, 1]])
            seen = T.copy()
            seen[1, 3] = 0.1 * i
            depth_m = -seen[2, 3] / (rays @ seen[2, :3])
            points_m = (rays * depth_m[..., None]) @ seen[:3, :3].T + seen[:3, 3]
            squares = (np.floor(points_m[..., 0] / 0.3) * 7 + np.floor(points_m[..., 1] / 0.3) * 13) % 5
            grey = (40 + 40 * squares).astype(np.uint8)
            yield np.repeat(grey[..., None], 3, axis=-1), depth_m.astype(np.float32), T

    write_episode(folder, "floor", "one", frames(), K=K, camera="made", floor_z_m=0.0)


def test_arrays_are_checked_and_a_pose_that_is_stuck_is_a_finding(tmp_path):
    looking_at_a_corner(tmp_path / "sound")
    done = check(tmp_path / "sound")
    assert done.exit_code == 0, done.output
    assert "(manifest arrays): 1 units looked at, 0 findings" in done.stdout
    looking_at_a_corner(tmp_path / "stuck", still=True)
    done = check(tmp_path / "stuck", "--json", "--sarif", tmp_path / "found.sarif")
    assert done.exit_code == 3, done.output
    said = json.loads(done.stdout)
    assert said["findings"]
    results = json.loads((tmp_path / "found.sarif").read_text())["runs"][0]["results"]
    assert [one["ruleId"] for one in results] == [one["reason"] for one in said["findings"]]


def test_homes_are_checked_and_a_trajectory_that_is_there_twice_is_a_finding(make_source, tmp_path):
    source = shutil.copytree(make_source(cameras=("d435i",)), tmp_path / "source")
    shutil.copytree(
        make_source(cameras=("d435i",), layout="scene_folder"), source, dirs_exist_ok=True
    )  # the same homes, unpacked
    done = check(source, "--dataset", "synthetic", "--github")
    assert done.exit_code == 3, done.output
    assert done.stderr.count("::error ") == done.stdout.count(": episode.duplicate: ") == 2
    assert "episode.duplicate: 2" in done.stdout


def test_a_folder_that_is_no_source_is_a_wrong_request(tmp_path):
    done = check(tmp_path)
    assert done.exit_code == 2
    assert "what was looked for" in done.stderr
