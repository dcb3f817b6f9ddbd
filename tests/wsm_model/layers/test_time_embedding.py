"""Timesteps."""

import math

import torch
from diffusers.models.embeddings import get_timestep_embedding

from wsm_model.layers.time_embedding import TimeEmbedding, sinusoid


def test_the_sinusoid_has_cosines_first_and_is_that_of_wan():
    times = torch.tensor([0.0, 1.0, 250.5, 1000.0])
    theirs = get_timestep_embedding(times, 32, flip_sin_to_cos=True, downscale_freq_shift=0)
    torch.testing.assert_close(sinusoid(times, 32), theirs, rtol=0, atol=1e-4)  # theirs: angles up to 1000 in float32


def test_the_sinusoid_is_exact_to_float32_at_the_largest_time():
    found = sinusoid(torch.tensor(1000.0), 4).tolist()
    second = 1000 * math.exp(-math.log(10000) / 2)
    wanted = [math.cos(1000), math.cos(second), math.sin(1000), math.sin(second)]
    assert max(abs(a - b) for a, b in zip(found, wanted, strict=True)) < 1e-7


def test_each_place_is_embedded_by_itself_in_float32_under_autocast():
    torch.manual_seed(0)
    embedding, times = TimeEmbedding(32, 16), torch.rand(2, 3) * 1000
    embedded, modulation = embedding(times)
    assert embedded.shape == (2, 3, 16)
    assert modulation.shape == (2, 3, 6, 16)
    with torch.autocast("cpu", torch.bfloat16):
        inside, _ = embedding(times)
    assert inside.dtype == torch.float32
    assert torch.equal(inside, embedded)
    torch.testing.assert_close(embedding(times[1, 2])[1], modulation[1, 2])
