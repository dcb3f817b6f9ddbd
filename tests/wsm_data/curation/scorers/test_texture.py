import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.curation.scorers.texture import texture_ratio


def test_it_is_the_variance_in_the_picture_over_that_in_the_release(make_images):
    latent = np.random.default_rng(1).normal(size=(3, 48, 2, 3)).astype(np.float16)
    std = np.linspace(0.5, 2.0, 48)
    expected = [np.var(latent[j, c].astype(float)) / std[c] ** 2 for j in range(3) for c in range(48)]
    assert texture_ratio(make_images(rgb_latent=latent, rgb_std=std, latents=3)) == pytest.approx(np.mean(expected))


def test_a_blank_wall_has_none_and_less_contrast_has_less(make_images):
    codec, rng = DctCodec(), np.random.default_rng(2)
    pattern = rng.uniform(-1, 1, size=(1, 32, 64, 3)).astype(np.float32)
    latents = [codec.encode(np.float32(contrast) * pattern + np.float32(0.1)) for contrast in (0.0, 0.2, 0.5, 0.8)]
    valid = np.full((1, 2, 4), 255, np.uint8)
    found = [texture_ratio(make_images(rgb_latent=one.astype(np.float16), depth_valid=valid)) for one in latents]
    assert found[0] == pytest.approx(0.0, abs=1e-6)  # the rounding of float16 latents
    assert found == sorted(found)


def test_a_channel_that_never_varies_is_left_out(make_images):
    latent = np.random.default_rng(1).normal(size=(4, 48, 2, 3)).astype(np.float16)
    latent[:, 24:] = 1.0
    std = np.concatenate([np.ones(24), np.zeros(24)])
    assert texture_ratio(make_images(rgb_latent=latent, rgb_std=std)) == pytest.approx(
        latent[:, :24].astype(float).var(axis=(2, 3)).mean()
    )
    assert texture_ratio(make_images(rgb_std=np.zeros(48))) == 0.0
