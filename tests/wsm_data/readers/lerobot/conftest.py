"""Two episodes that drift over a floor, as LeRobot data sets of both versions."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.dataset import CameraModel
from wsm_data.schema.source.motion import Motion

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

WIDTH, HEIGHT = 64, 48
LEVEL = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0.8], [0, 0, 0, 1]])  # looks along y


def make_walk(frames, seed):
    from lerobot_set import Walk

    rng = np.random.default_rng(seed)
    small = rng.integers(0, 256, (HEIGHT // 8, WIDTH // 8, 3), np.uint8)
    poses = np.tile(LEVEL, (frames, 1, 1))
    poses[:, 1, 3] = 0.1 * np.arange(frames)
    return Walk(
        rgb=[np.roll(small, frame, axis=1).repeat(8, axis=0).repeat(8, axis=1) for frame in range(frames)],
        depth_m=[rng.uniform(0.0, 12.0, (HEIGHT, WIDTH)).astype(np.float32) for _ in range(frames)],
        T_world_camera=list(poses),
    )


@pytest.fixture(scope="session")
def walks():
    return [make_walk(6, 0), make_walk(9, 1)]


@pytest.fixture(scope="session", params=[2, 3], ids=["v2.1", "v3.0"])
def lerobot_root(request, walks, tmp_path_factory):
    pytest.importorskip("av", reason="the extra lerobot is not installed")
    from lerobot_set import write_set

    root = tmp_path_factory.mktemp(f"version_{request.param}") / "drift"
    write_set(root, walks, version=request.param)
    return root


@pytest.fixture(scope="session")
def dataset():
    made = load_dataset("lerobot")
    return replace(
        made,
        features=replace(made.features, depth="observation.images.depth"),
        motion=Motion(carried_by="hand", floor_z_m=0.0),
        cameras={"camera": CameraModel(width=WIDTH, height=HEIGHT, fx=60.0, fy=61.0, cx=31.5, cy=23.5)},
    )
