import json
import re

import cv2
import numpy as np
import pytest

from wsm_data.readers.arrays import EPISODE_FILE, write_episode

K = np.array([[24.0, 0, 15.5], [0, 24.0, 11.5], [0, 0, 1]])


def frame(**changes):
    rng = np.random.default_rng(0)
    whole = {
        "rgb_u8": rng.integers(0, 256, (24, 32, 3), dtype=np.uint8),
        "depth_m": rng.uniform(0.5, 4, (24, 32)).astype(np.float32),
        "T_world_camera": np.eye(4),
    }
    return tuple({**whole, **changes}.values())


def test_colour_poses_and_camera_are_stored_to_the_bit_and_depth_to_a_tenth_of_a_millimetre(tmp_path):
    rgb, depth, _ = frame()
    depth[0, :3] = 0, np.nan, 7.0  # the last is farther than 16 bits reach
    T = np.eye(4)
    T[:3, 3] = 0.1, 1 / 3, -2
    folder = write_episode(tmp_path, "kitchen", "one", [(rgb, depth, T)], K=K, camera="cam", floor_z_m=-1.5)
    assert folder == tmp_path / "kitchen" / "one"
    stored = cv2.imread(str(folder / "rgb" / "000000.png"))
    assert np.array_equal(stored[..., ::-1], rgb)
    codes = cv2.imread(str(folder / "depth" / "000000.png"), cv2.IMREAD_UNCHANGED)
    assert codes[0, :3].tolist() == [0, 0, 0]
    assert np.abs(codes[1:] * 1e-4 - depth[1:]).max() <= 0.5e-4 + 1e-7  # rounding, and that of float32
    said = json.loads((folder / EPISODE_FILE).read_text())
    assert np.array_equal(np.reshape(said["T_world_camera"][0], (4, 4)), T)
    assert np.array_equal(said["K"], K)
    assert (said["camera"], said["floor_z_m"]) == ("cam", -1.5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rgb_u8": np.zeros((24, 32, 3), np.float32)}, "rgb_u8 of frame 1 must be uint8"),
        ({"rgb_u8": np.zeros((24, 30, 3), np.uint8)}, "rgb_u8 of frame 1 must be uint8 [24, 32, 3]"),
        ({"depth_m": np.zeros((24, 32), np.uint16)}, "depth_m of frame 1 must be float32"),
        ({"depth_m": np.zeros((12, 16), np.float32)}, "depth_m of frame 1 must be float32 [24, 32]"),
        ({"depth_m": np.full((24, 32), 1500, np.float32)}, "is it in millimetres"),
        ({"depth_m": np.full((24, 32), -1, np.float32)}, "not negative"),
        ({"T_world_camera": np.eye(4, dtype=np.float32)}, "T_world_camera of frame 1 must be float64"),
        ({"T_world_camera": 2 * np.eye(4)}, "a rotation and a translation"),
        ({"T_world_camera": np.full((4, 4), np.nan)}, "must be finite"),
    ],
)
def test_a_wrong_array_is_refused_with_its_frame_and_nothing_is_left_behind(tmp_path, changes, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        write_episode(tmp_path, "kitchen", "one", [frame(), frame(**changes)], K=K)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_an_episode_that_is_refused_leaves_the_older_one_as_it_was(tmp_path):
    folder = write_episode(tmp_path, "kitchen", "one", [frame()], K=K)
    before = (folder / EPISODE_FILE).read_bytes()
    with pytest.raises(ValueError, match="must be float64"):
        write_episode(tmp_path, "kitchen", "one", [frame(), frame(T_world_camera=np.eye(4, dtype=int))], K=K)
    assert (folder / EPISODE_FILE).read_bytes() == before


def test_depth_is_in_all_frames_of_an_episode_or_in_none_and_without_it_the_floor_is_stated(tmp_path):
    bare = frame(depth_m=None)
    folder = write_episode(tmp_path, "kitchen", "one", [bare, bare], K=K, floor_z_m=0.0, goal_world_m=(1.0, 2.0, 0.5))
    said = json.loads((folder / EPISODE_FILE).read_text())
    assert (said["depth"], said["goal_world_m"]) == (False, [1.0, 2.0, 0.5])
    assert not (folder / "depth").exists()
    with pytest.raises(ValueError, match="or none, found 1 of 2"):
        write_episode(tmp_path, "kitchen", "one", [frame(), bare], K=K, floor_z_m=0.0)
    with pytest.raises(ValueError, match="floor_z_m must be given"):
        write_episode(tmp_path, "kitchen", "one", [bare], K=K)
    with pytest.raises(ValueError, match="goal_world_m must be finite"):
        write_episode(tmp_path, "kitchen", "one", [bare], K=K, floor_z_m=0.0, goal_world_m=(0.0, np.inf, 0.0))


@pytest.mark.parametrize(
    ("matrix", "said"),
    [(np.eye(4), "K must be float64"), (K + 1, "K must be"), (K * [[20], [20], [1]], "another image size")],
)
def test_a_camera_that_is_none_is_refused(tmp_path, matrix, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        write_episode(tmp_path, "kitchen", "one", [frame()], K=matrix)


@pytest.mark.parametrize(
    ("scene", "camera", "said"),
    [("../x", "cam", "not a path"), ("s", "my_cam", "or hold"), ("s", "", "must not be empty")],
)
def test_names_that_cannot_be_are_refused(tmp_path, scene, camera, said):
    with pytest.raises(ValueError, match=said):
        write_episode(tmp_path, scene, "one", [frame()], K=K, camera=camera)
    with pytest.raises(ValueError, match="must have frames"):
        write_episode(tmp_path, "kitchen", "one", [], K=K)
