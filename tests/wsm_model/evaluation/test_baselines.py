import numpy as np
import pytest
import torch

from wsm_model.evaluation.baselines import counted_depth, fit_baselines, recorded_frames


def test_the_constant_map_is_the_geometric_mean_of_each_pixel_over_frames_that_count(batch, decoding):
    batch.still[0, 4:] = True
    frames = [
        decoding.depth_m(batch.depth[0, :5])[:13],  # the anchor's frame and those of three latents
        decoding.depth_m(batch.depth[1, :4]),
    ]
    wanted = np.exp(np.log(np.concatenate(frames).astype(float)).mean(axis=0))
    np.testing.assert_allclose(fit_baselines([batch], decoding, 2).depth_map_m, wanted, rtol=1e-6)


def test_a_pixel_that_was_never_measured_takes_the_mean_of_all_others(batch, decoding):
    batch.depth_valid[..., 0, 0] = 127  # less than half
    found = fit_baselines([batch], decoding, 2).depth_map_m
    assert np.unique(found[:16, :16]).size == 1
    assert found[:16, :16].mean() == pytest.approx(np.exp(np.log(found[16:]).mean()), rel=0.05)


def test_depth_counts_in_recorded_frames_and_measured_cells_alone(batch, decoding):
    batch.still[0, 3:] = True
    batch.depth_valid[0, 1, 2, 3] = 0
    counts = counted_depth(batch, 0, decoding)
    assert counts.shape == (17, 64, 96)
    assert counts[0].all()
    assert not counts[1:5, 32:48, 48:64].any()  # the four frames of latent 1
    assert counts[1:5].sum() == 4 * (64 * 96 - 16 * 16)
    assert not counts[9:].any()
    assert recorded_frames(batch, 0).tolist() == [True] * 9 + [False] * 8


def test_factors_of_a_copy_are_the_correlations_of_each_channel_at_each_distance(batch, decoding):
    """An autoregressive sequence x' = a x + noise has E[x_(t+k) x_t] / E[x_t^2] = a^k."""
    generator, factor = torch.Generator().manual_seed(0), torch.linspace(0, 0.9, 48)[:, None, None]
    x = torch.randn(2, 48, 4, 6, generator=generator)
    for latent in range(5):
        batch.rgb[:, latent] = x
        x = factor * x + (1 - factor**2).sqrt() * torch.randn(x.shape, generator=generator)
    shrink = fit_baselines([batch], decoding, 2).shrink
    assert (shrink[0] - factor.flatten()).abs().max() < 0.3
    assert (shrink[1] - factor.flatten() ** 2).abs().mean() < 0.1


def test_a_distance_that_no_clip_reaches_has_the_factor_zero(batch, decoding):
    assert (fit_baselines([batch], decoding, 6).shrink[4:] == 0).all()
