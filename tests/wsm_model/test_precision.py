"""Matrices kept in bfloat16: half the memory, and the same answers as autocast gives with float32 weights."""

import pytest
import torch

from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.inference.session import Session, SessionConfig
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import ModelCard, load_model, save_model
from wsm_model.precision import Precision, autocast, matrices, stored_precision
from wsm_model.presets import PRESETS

STANDARD = LatentStandard(
    codec="dct", codec_digest="c0dec", rgb_mean=(0.0,), rgb_std=(1.0,), depth_mean=(0.5,), depth_std=(2.0,)
)


@pytest.fixture
def both(make_model, tmp_path):
    """One model as it was saved, in float32 and in bfloat16."""
    model = make_model().eval()
    save_model(tmp_path, model, ModelCard(config=model.config, standard=STANDARD, releases=("r",), steps=1))
    return model, load_model(tmp_path, precision=Precision.BFLOAT16)[0]


def test_estimates_and_dreams_are_those_under_autocast_to_the_bit(both, make_inputs, make_spans):
    """Autocast rounds each matrix before each product: to round it once before is the same."""
    inputs, found = make_inputs(make_spans([5], [2])), []
    for model in both:
        session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
        session._precision = lambda: autocast(Precision.BFLOAT16, torch.device("cpu"))
        episode = session.start()
        for latent in range(5):
            (states,) = session.observe([episode], inputs.rgb[:, latent])
        (dream,) = session.dream([episode], inputs.goal_camera0_m, inputs.noisy_rgb[:, None, :2], [1.0, 0.5, 0.0])
        found.append((states.depth, states.poses, dream.rgb, dream.depth, dream.poses))
    for exact, stored in zip(*found, strict=True):
        assert torch.equal(exact, stored)
        assert stored.dtype == torch.float32


def test_a_session_runs_a_model_as_its_matrices_are_stored(both, make_inputs, make_spans):
    """8 bits of bfloat16 in two layers: poses agree to a few percent, and are not the same."""
    inputs, poses = make_inputs(make_spans([3], [2])), []
    for model in both:
        session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
        episode = session.start()
        poses.append([session.observe([episode], inputs.rgb[:, latent])[0].poses for latent in range(3)][-1])
    assert [stored_precision(model) for model in both] == [Precision.FLOAT32, Precision.BFLOAT16]
    torch.testing.assert_close(*poses, rtol=0.1, atol=0.05)
    assert not torch.equal(*poses)


def test_autocast_keeps_no_rounded_copy_of_a_weight():
    """torch keeps them until the end of the context unless it is told not to: a copy of the whole model."""
    assert torch.is_autocast_cache_enabled()
    with autocast(Precision.BFLOAT16, torch.device("cpu")):
        assert not torch.is_autocast_cache_enabled()


def test_what_computes_in_float32_keeps_its_weights_and_the_rest_is_halved():
    """At the paper's size 24.5 GB become 12.4 GB: all but 1 % are matrices that autocast rounds."""
    with torch.device("meta"):
        model = WorldSlamModel(PRESETS["wsm5b"])
    rounded = matrices(model)
    sizes = {name: parameter.numel() for name, parameter in model.named_parameters()}
    halved, kept = (
        sum(size for name, size in sizes.items() if (name in rounded) is chosen) for chosen in (True, False)
    )
    assert not any(".time." in name or "norm" in name or "table" in name for name in rounded)
    assert "experts.pose.head.linear_1.weight" not in rounded
    assert 4 * (halved + kept) == pytest.approx(24.48e9, rel=0.01)
    assert 2 * halved + 4 * kept == pytest.approx(12.42e9, rel=0.01)
