"""Two held-out clips of random content, and what measures them."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from wsm_data.codecs.dct import DctCodec
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.evaluation.baselines import fit_baselines
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.held_out import HeldOutSettings
from wsm_model.inference.session import SessionConfig

CHANNELS = 48


@pytest.fixture
def batch(make_poses, make_spans):
    torch.manual_seed(0)
    poses = make_poses(2, 5, 4)
    poses[:, 0] = torch.tensor([0.0, 0, 0, 1, 0, 0, 0])
    return SimpleNamespace(
        still=torch.zeros(2, 5, 4, dtype=torch.bool),
        rgb=torch.randn(2, 5, CHANNELS, 4, 6),
        depth=torch.randn(2, 5, CHANNELS, 4, 6),
        depth_valid=torch.full((2, 5, 4, 6), 255, dtype=torch.uint8),
        poses=poses,
        spans=make_spans([5, 4], [2, 2]),
        goal_camera0_m=torch.randn(2, 3),
        refs=np.arange(2),
        keys=("a", "b"),
        epoch=0,
        step=0,
    )


@pytest.fixture
def decoding() -> Decoding:
    """Of the built-in codec, with a mean and a deviation at which random latents decode to pictures in their range."""
    moments = {"rgb_mean": (0.0,) * CHANNELS, "rgb_std": (0.2,) * CHANNELS}
    depth = {"depth_mean": (0.0,) * CHANNELS, "depth_std": (0.2,) * CHANNELS}
    standard = LatentStandard(codec="dct", codec_digest="d", **moments, **depth)
    return Decoding(codec=DctCodec(), standard=standard, depth_range=DepthRange())


@pytest.fixture
def make_settings(batch, decoding):
    """Settings for the clips as they are when it is called."""

    def make(**changes) -> HeldOutSettings:
        settings = {
            "session": SessionConfig(chunk_size=2, cache_latents=16),
            "schedule": [1.0, 0.5, 0.0],
            "decoding": decoding,
            "baselines": fit_baselines([batch], decoding, 2),
        }
        return HeldOutSettings(**{**settings, **changes})

    return make
