"""Synthetic sources are read as InternNav's public NavDP loaders read InternData-N1: the same files, shapes and axes.

The loaders themselves need open3d and a training stack; here their accesses are made one by one, in our words
(internnav/dataset/navdp_lerobot_dataset.py for scene folders, its predecessor for trajectory folders).
"""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh
from PIL import Image

from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.home import make_home
from wsm_data.synth.writers import recording
from wsm_data.synth.writers.scenes import write_scene

SMALL = SynthConfig(
    scenes=1, trajectories=2, image_scale=0.5, min_frames=12, max_frames=40, min_step_m=0.08, max_step_m=0.3
)
OBSTACLE, PATH = np.array([0, 0, 0.5]), np.array([0, 0, 0])
RGB, DEPTH = "videos/chunk-000/observation.images.rgb", "videos/chunk-000/observation.images.depth"


@pytest.fixture(scope="module")
def roots(tmp_path_factory) -> dict[str, Path]:
    """Root of one tree for each layout (and way of storing matrices) that the loaders know."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "make_home", cache(make_home))
        for layout, matrices in (("scene_folder", "nested"), ("scene_folder", "flat"), ("trajectory_folder", "nested")):
            root = tmp_path_factory.mktemp(f"{layout}_{matrices}")
            write_scene(root, 0, "d435i", replace(SMALL, layout=layout, matrices=matrices))
            found[f"{layout}_{matrices}"] = root
    return found


def only_entry(folder: Path) -> Path:
    """The loaders take whatever a listing shows for a group, a scene or a chunk."""
    (entry,) = folder.iterdir()
    return entry


def scene_episodes(scene: Path) -> list[tuple[Path, list[Path], list[Path]]]:
    """Table, pictures and depth images of each episode, by position in sorted listings and by `image_index`."""
    chunk = only_entry(scene / "data").name
    tables = sorted((scene / "data" / chunk).iterdir())
    pictures = sorted((scene / "videos" / chunk / "observation.images.rgb").iterdir())
    depths = sorted((scene / "videos" / chunk / "observation.images.depth").iterdir())
    lines = (scene / "meta" / "episodes_stats.jsonl").read_text().splitlines()
    episodes = []
    for table, line in zip(tables, lines, strict=True):
        span = json.loads(line)["image_index"]
        chosen = slice(span["min"], span["max"] + 1)
        episodes.append((table, pictures[chosen], depths[chosen]))
    return episodes


def matrices(table: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Camera matrix and mount of the first row, poses of all rows; rows may be nested or flat."""
    columns = pq.read_table(table)
    K = np.vstack(columns["observation.camera_intrinsic"].to_pylist()[0]).reshape(3, 3)
    mount = np.vstack(columns["observation.camera_extrinsic"].to_pylist()[0]).reshape(4, 4)
    poses = np.array([np.stack(frame) for frame in columns["action"].to_pylist()]).reshape(-1, 4, 4)
    return K, mount, poses


def cloud_of(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points, and colours in [0, 1] as open3d gives them."""
    cloud = trimesh.load(path)
    return np.asarray(cloud.vertices), np.asarray(cloud.colors)[:, :3] / 255.0


def ahead_left_up(poses: np.ndarray, mount: np.ndarray) -> np.ndarray:
    """Positions in the frame of the robot at the first pose: the camera's turn less the mount's leaves the yaw."""
    base = np.eye(4)
    base[:3, :3] = poses[0, :3, :3] @ np.linalg.inv(mount[:3, :3])
    base[:3, 3] = poses[0, :3, 3]
    right_ahead_up = (np.linalg.inv(base) @ poses[:, :, 3].T).T[:, :3]
    return np.stack([right_ahead_up[:, 1], -right_ahead_up[:, 0], right_ahead_up[:, 2]], axis=1)


@pytest.mark.parametrize("kind", ["scene_folder_nested", "scene_folder_flat"])
def test_a_scene_folder_gives_every_episode_its_own_frames(roots, kind):
    scene = only_entry(only_entry(roots[kind]))
    episodes = scene_episodes(scene)
    assert len(episodes) == SMALL.trajectories
    for number, (table, pictures, depths) in enumerate(episodes):
        _, _, poses = matrices(table)
        assert len(pictures) == len(depths) == len(poses)
        assert {path.name[:14] for path in (*pictures, *depths)} == {f"episode_{number:06d}"}
        assert [path.stem for path in pictures] == [path.stem for path in depths]


def test_images_have_the_types_the_loader_asks_for_and_depth_is_metres_times_10000(roots):
    scene = only_entry(only_entry(roots["scene_folder_nested"]))
    for _, pictures, depths in scene_episodes(scene):
        picture = np.array(Image.open(pictures[0]), np.uint8)
        depth = np.array(Image.open(depths[0]), np.uint16)
        assert picture.shape == (135, 240, 3)
        assert depth.shape == (135, 240)
        depth_m = depth / 10000.0
        assert ((depth_m > 0.1) & (depth_m < 5.0)).mean() > 0.5  # what the loader keeps


@pytest.mark.parametrize("kind", ["scene_folder_nested", "scene_folder_flat", "trajectory_folder_nested"])
def test_the_future_lies_ahead_in_the_robot_s_frame(roots, kind):
    scene = only_entry(only_entry(roots[kind]))
    for table in sorted(scene.rglob("*.parquet")):
        _, mount, poses = matrices(table)
        for start in range(0, len(poses) - 1, 5):
            ahead, left, up = ahead_left_up(poses[start:], mount)[1]
            assert ahead > 0
            assert abs(left) < 0.6 * ahead
            assert abs(up) < 1e-5


def test_a_goal_on_the_floor_is_marked_where_the_camera_sees_it(roots):
    scene = only_entry(only_entry(roots["scene_folder_nested"]))
    for table, _, _ in scene_episodes(scene):
        K, mount, poses = matrices(table)
        ahead, left, _ = ahead_left_up(poses, mount)[8]
        # the loader's projection, with the whole height of the mount instead of four fifths of it
        x, y, z = mount[:3, :3] @ (-left, ahead, mount[2, 3])
        marked = K[0, 2] + x / z * K[0, 0], K[1, 2] - y / z * K[1, 1]
        seen = np.linalg.inv(poses[0]) @ (*poses[8, :2, 3], 0.0, 1.0)  # OpenGL: y up, z backward
        true = K[0, 2] + seen[0] / -seen[2] * K[0, 0], K[1, 2] - seen[1] / -seen[2] * K[1, 1]
        assert seen[2] < 0
        assert marked == pytest.approx(true, abs=0.01)  # px; the poses are float32


def test_obstacles_are_found_by_their_colour_and_the_path_keeps_off_them(roots):
    scene = only_entry(only_entry(roots["scene_folder_nested"]))
    points, colours = cloud_of(scene / "meta" / "pointcloud.ply")
    obstacles = points[np.abs(colours - OBSTACLE).sum(axis=1) < 0.05]
    assert len(obstacles) > 1000
    for table, _, _ in scene_episodes(scene):
        _, _, poses = matrices(table)
        apart = np.abs(poses[:, None, :2, 3] - obstacles[None, ::7, :2]).sum(axis=-1).min()
        assert apart > 0.1  # nearer than this the loader's critic punishes


def test_a_trajectory_folder_is_read_by_counting(roots):
    scene = only_entry(only_entry(roots["trajectory_folder_nested"]))
    assert sorted(path.name for path in scene.iterdir()) == ["trajectory_00", "trajectory_01"]
    for folder in scene.iterdir():
        _, _, poses = matrices(folder / "data/chunk-000/episode_000000.parquet")
        count = len(list((folder / RGB).iterdir()))
        assert len(list((folder / DEPTH).iterdir())) == count == len(poses)
        assert all(
            (folder / RGB / f"{i}.jpg").is_file() and (folder / DEPTH / f"{i}.png").is_file() for i in range(count)
        )


def test_the_path_of_a_trajectory_is_black_in_its_cloud(roots):
    scene = only_entry(only_entry(roots["trajectory_folder_nested"]))
    for folder in scene.iterdir():
        points, colours = cloud_of(folder / "data/chunk-000/path.ply")
        _, _, poses = matrices(folder / "data/chunk-000/episode_000000.parquet")
        path = points[np.abs(colours - PATH).sum(axis=1) < 0.05]
        assert path == pytest.approx(poses[:, :3, 3], abs=1e-6)
        near = (points[:, :2] >= path.min(axis=0)[:2] - 2).all(axis=1)
        near &= (points[:, :2] <= path.max(axis=0)[:2] + 2).all(axis=1)
        assert ((np.abs(colours - OBSTACLE).sum(axis=1) < 0.05) & near).any()
