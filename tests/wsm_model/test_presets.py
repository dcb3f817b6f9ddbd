"""Named sizes."""

import pytest
import torch

from wsm_data.errors import ConfigError
from wsm_model.config import ExpertConfig, ModelConfig, Prediction, Variant
from wsm_model.model import WorldSlamModel
from wsm_model.presets import PRESETS, preset


@pytest.mark.parametrize(
    ("name", "low", "high"), [("tiny", 2e6, 9e6), ("small", 0.9e8, 1.3e8), ("wsm5b", 6.0e9, 6.2e9)]
)
def test_sizes_have_the_parameters_they_promise(name, low, high):
    """A few million, about 100 million, and the paper's 6.7 billion without 0.57 that one goal token cannot reach."""
    with torch.device("meta"):
        count = sum(parameter.numel() for parameter in WorldSlamModel(preset(name)).parameters())
    assert low < count < high


def test_a_size_takes_the_latents_of_the_release_and_the_variant():
    found = preset("tiny", latent_height=6, latent_width=10, variant=Variant.IDM)
    assert (found.patches, found.variant) == (15, Variant.IDM)
    assert PRESETS["tiny"].patches == 60


def test_an_unknown_size_names_the_nearest():
    with pytest.raises(ConfigError, match="did you mean small"):
        preset("smal")


def test_latents_that_cannot_be_cut_into_patches_are_refused():
    with pytest.raises(ValueError, match="cannot be cut into patches"):
        preset("tiny", latent_height=5)


def test_shapes_that_cannot_be_built_are_refused():
    expert = ExpertConfig(width=8, feed_forward_width=8)
    with pytest.raises(ValueError, match="head_width must be even"):
        ModelConfig(generation=expert, depth=expert, pose=expert, layers=1, heads=1, head_width=7)
    with pytest.raises(ValueError, match="even width"):
        ExpertConfig(width=7, feed_forward_width=8)


def test_the_tiny_size_predicts_latents_and_those_of_the_paper_the_velocity():
    found = {name: one.prediction for name, one in PRESETS.items()}
    assert found == {"tiny": Prediction.CLEAN, "small": Prediction.VELOCITY, "wsm5b": Prediction.VELOCITY}
