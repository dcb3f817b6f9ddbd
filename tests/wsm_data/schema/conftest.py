"""One valid clip, in parts that a test may spoil."""

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.identity import EpisodeId

FRAMES, LATENTS = 9, 3


@pytest.fixture
def meta_fields():
    """Keyword arguments of a valid ClipMeta, with numbers that have no short decimal form."""
    episode = EpisodeId("gibson_d435i", "Ackermanville", "000003")
    return {
        "key": episode.key,
        "id": episode,
        "dataset": "interndata_n1",
        "source_digest": "0" * 32,
        "map_digest": "1" * 64,
        "intrinsics": Intrinsics(fx=355.81 * 2 / 3, fy=351.69 / 1.40625, cx=159.83, cy=95.8, width=320, height=192),
        "T_world_camera0": (
            (1 / 3, 0.1, -0.0, 1e-300),
            (0.0, 1.0, 0.0, 2.0),
            (0.0, 0.0, 1.0, 3.0),
            (0.0, 0.0, 0.0, 1.0),
        ),
        "goal_world_m": (0.1 + 0.2, -7.7, 1.0),
        "goal_camera0_m": (1e16 + 2.0, 5e-324, -1 / 3),
        "map_origin_cell": (-120, 44),
        "map_resolution_m": 0.05,
        "map_from": "cloud",
        "freed_cells": 3,
        "goal_radius_m": 0.2,
        "robot_radius_m": 0.25,
        "camera_height_m": 0.61,
        "camera_pitch_rad": np.pi / 17,
        "frames": FRAMES,
        "padded_frames": 2,
        "codec": "dct",
        "codec_digest": "2" * 64,
        "depth_range": DepthRange(),
        "notes": ("cloud.missing", "episode.length_mismatch"),
    }


@pytest.fixture
def clip_fields(meta_fields):
    """Keyword arguments of a valid Clip: 9 raw frames, 3 latent frames."""
    rng = np.random.default_rng(7)
    poses = np.zeros((FRAMES, 7), np.float32)
    poses[:, 3] = 1
    poses[:, 2] = np.linspace(0, 2, FRAMES)
    return {
        "meta": ClipMeta(**meta_fields),
        "rgb_latent": rng.normal(size=(LATENTS, 48, 12, 20)).astype(np.float16),
        "depth_latent": rng.normal(size=(LATENTS, 48, 12, 20)).astype(np.float16),
        "depth_valid": rng.integers(0, 256, (LATENTS, 12, 20), np.uint8),
        "poses": poses,
        "occupancy": rng.choice(np.array([0, 1, 255], np.uint8), (30, 40)),
        "geodesic_mm": rng.integers(0, 65536, (30, 40), np.uint16),
        "expert_distance": np.linspace(2, 0, FRAMES, dtype=np.float32),
    }
