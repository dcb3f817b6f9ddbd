"""The ends of an expert: what its tokens are made from, and which copy it reads."""

from dataclasses import replace

import pytest
import torch

from wsm_model.config import Expert

FRAMES = 3


@pytest.fixture
def latents(config) -> torch.Tensor:
    """Two copies of three random latents, [B, G, F, C, h, w]."""
    shape = (1, 2, FRAMES, config.latent_channels, config.latent_height, config.latent_width)
    return torch.randn(shape, generator=torch.Generator().manual_seed(0))


def stream_of(model, latents, time, prediction=1):
    """Tokens of the generation expert."""
    return model.expert(Expert.GENERATION).stream(latents, time, torch.arange(FRAMES)[None], prediction)


def test_a_time_of_a_frame_is_the_time_of_each_of_its_tokens(make_model, latents, config):
    model, times = make_model(), torch.rand(1, 2, FRAMES) * 1000
    by_frame = stream_of(model, latents, times)
    by_token = stream_of(model, latents, times[..., None].expand(-1, -1, -1, config.patches))
    assert by_frame.time.shape[-2] == 1
    torch.testing.assert_close(by_token.modulation, by_frame.modulation.expand_as(by_token.modulation))
    expert = model.expert(Expert.GENERATION)
    torch.testing.assert_close(expert.read(by_token), expert.read(by_frame))


def test_only_the_prediction_copy_is_read_and_by_its_own_time(make_model, latents):
    model = make_model()
    expert, times = model.expert(Expert.GENERATION), torch.rand(1, 2, FRAMES) * 1000
    stream = stream_of(model, latents, times)
    read = expert.read(stream)
    assert read.shape == latents[:, 1].shape
    clean_changed = stream.x.clone()
    clean_changed[:, 0] = float("nan")
    assert torch.equal(expert.read(stream.with_tokens(clean_changed)), read)
    other_time = stream_of(model, latents, times * torch.tensor([0.0, 1.0]).view(1, 2, 1))
    assert torch.equal(expert.read(replace(other_time, x=stream.x)), read)  # the time of the clean copy is not its own


def test_clean_tokens_alone_cannot_be_read(make_model, latents):
    model = make_model()
    stream = stream_of(model, latents, torch.zeros(1, 2, FRAMES), None)
    with pytest.raises(ValueError, match="clean tokens predict nothing"):
        model.expert(Expert.GENERATION).read(stream)


def test_the_two_copies_of_a_latent_share_their_positions(make_model, latents):
    """Specification, section 4: clean, noisy and query copies share positions."""
    cos, sin = stream_of(make_model(), latents, torch.zeros(1, 2, FRAMES)).rope
    assert cos.shape[1] == sin.shape[1] == 1
