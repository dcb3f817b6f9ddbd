"""Small models with no weight at its initial zero, and batches of random sequences."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.config import ExpertConfig, ModelConfig, Variant
from wsm_model.inputs import ModelInputs
from wsm_model.model import Attention, WorldSlamModel

torch.set_num_threads(1)  # tensors of a few thousand numbers: a second thread only waits, and that costs a core

CONFIG = ModelConfig(
    generation=ExpertConfig(width=48, feed_forward_width=64),
    depth=ExpertConfig(width=32, feed_forward_width=48),
    pose=ExpertConfig(width=24, feed_forward_width=40),
    layers=2,
    heads=2,
    head_width=12,
    latent_channels=6,
    latent_height=4,
    latent_width=6,
    time_frequencies=32,
    goal_frequencies=4,
    pose_hidden=24,
)


def random_poses(*shape: int, generator: torch.Generator | None = None) -> torch.Tensor:
    """Random translations and unit quaternions, [*shape, 7]."""
    poses = torch.randn(*shape, 7, generator=generator)
    poses[..., 3:] = torch.nn.functional.normalize(poses[..., 3:], dim=-1)
    return poses


def spans_of(lengths: Sequence[int], chunk_sizes: Sequence[int]) -> tuple[SequenceSpan, ...]:
    """One sequence a row, from its first latent on."""
    return tuple(
        SequenceSpan(row=row, start=0, length=length, chunk_size=size)
        for row, (length, size) in enumerate(zip(lengths, chunk_sizes, strict=True))
    )


@pytest.fixture
def config() -> ModelConfig:
    """A model of a few ten thousand parameters."""
    return CONFIG


@pytest.fixture(scope="session")
def make_model() -> Callable[..., WorldSlamModel]:
    """Builds a model whose every weight is random: none is at the zero that some begin with."""

    def make(variant: Variant = Variant.SLAM, attention: Attention = Attention.BLOCKS, **changes: object):
        torch.manual_seed(0)
        model = WorldSlamModel(replace(CONFIG, variant=variant, **changes), attention)
        for parameter in model.parameters():
            if not parameter.detach().count_nonzero():
                torch.nn.init.normal_(parameter, std=0.1)
        return model

    return make


@pytest.fixture
def make_inputs() -> Callable[..., ModelInputs]:
    """Builds a teacher-forced batch of random content."""

    def make(spans: Sequence[SequenceSpan], *, frames: int | None = None, seed: int = 1, **changes: torch.Tensor):
        generator = torch.Generator().manual_seed(seed)
        rows = 1 + max(span.row for span in spans)
        frames = frames or max(span.start + span.length for span in spans)
        latents = (rows, frames, CONFIG.latent_channels, CONFIG.latent_height, CONFIG.latent_width)
        values = {
            "rgb": torch.randn(latents, generator=generator),
            "depth": torch.randn(latents, generator=generator),
            "poses": random_poses(rows, frames, CONFIG.pose_slots, generator=generator),
            "goal_camera0_m": torch.randn(len(spans), 3, generator=generator),
            "noisy_rgb": torch.randn(latents, generator=generator),
            "flow_time": torch.rand(rows, frames, generator=generator),
        }
        return ModelInputs(**(values | changes), spans=tuple(spans))

    return make


@pytest.fixture
def make_spans() -> Callable[..., tuple[SequenceSpan, ...]]:
    """`spans_of`."""
    return spans_of


@pytest.fixture(scope="session")
def make_poses() -> Callable[..., torch.Tensor]:
    """`random_poses`."""
    return random_poses
