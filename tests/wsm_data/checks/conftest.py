"""Trajectories without files: a level or pitched camera that drives along a line."""

from collections.abc import Callable

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CameraModel, DatasetManifest
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

D435I = {"fx": 355.81, "fy": 351.69, "cx": 240.0, "cy": 135.0, "width": 480, "height": 270}


def driving_poses(yaw_rad: np.ndarray, xyz_m: np.ndarray, pitch_deg: float) -> np.ndarray:
    """OpenCV cameras in a world with z up: ahead along (cos yaw, sin yaw), pitched down; float64 [T, 4, 4]."""
    pitch = np.deg2rad(pitch_deg)
    T = np.tile(np.eye(4), (len(yaw_rad), 1, 1))
    ahead = np.stack([np.cos(yaw_rad), np.sin(yaw_rad), np.zeros_like(yaw_rad)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    forward = np.cos(pitch) * ahead - np.sin(pitch) * up
    right = np.cross(ahead, up)
    T[:, :3, 0], T[:, :3, 1], T[:, :3, 2], T[:, :3, 3] = right, np.cross(forward, right), forward, xyz_m
    return T


@pytest.fixture(scope="session")
def make_record() -> Callable[..., EpisodeRecord]:
    def make(frames=40, step_m=0.06, turn_deg=1.5, pitch_deg=10.0, height_m=0.5, **fields: object) -> EpisodeRecord:
        yaw = np.deg2rad(turn_deg) * np.arange(frames)
        xy = np.cumsum(step_m * np.stack([np.cos(yaw), np.sin(yaw)], axis=1), axis=0)
        xyz = np.column_stack([xy, np.full(frames, height_m)])
        values = {
            "id": EpisodeId("gibson_d435i", "scene", "000000"),
            "container": "gibson_d435i/scene",
            "rgb_members": tuple(f"{t}.jpg" for t in range(frames)),
            "depth_members": tuple(f"{t}.png" for t in range(frames)),
            "T_world_camera": driving_poses(yaw, xyz, pitch_deg),
            "intrinsics": Intrinsics(**D435I),
            "camera_height_m": height_m,
            "camera_pitch_rad": float(np.deg2rad(pitch_deg)),
            "frames_digest": "f",
            "content_digest": "c",
        }
        return EpisodeRecord(**{**values, **fields})

    return make


@pytest.fixture(scope="session")
def dataset() -> DatasetManifest:
    encoding = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
    return DatasetManifest(name="d", licence="l", depth=encoding, cameras={"d435i": CameraModel(**D435I)})
