from types import SimpleNamespace

import pytest

from wsm_model.batches import training_inputs
from wsm_model.evaluation.flow import flow_matching_errors
from wsm_model.losses.flow import flow_errors


def true_velocity(inputs):
    """eps - x from x_tau = (1 - tau) x + tau eps: a model that knows what is to come."""
    tau = inputs.flow_time[..., None, None, None].clamp(min=1e-3)
    return SimpleNamespace(velocity=(inputs.noisy_rgb - inputs.rgb) / tau)


def test_copying_is_exact_where_nothing_changes_and_the_unconditional_guess_is_right_on_average(make_model, batch):
    model = make_model(latent_channels=48)
    batch.rgb = batch.rgb[:, :1].expand(-1, 5, -1, -1, -1).clone()
    errors = flow_matching_errors(model, [batch], seed=0, shift=5.0)
    assert errors.copy == pytest.approx(0.0, abs=1e-9)
    assert 0 < errors.unconditional < 2.2  # at most the variance of eps - x, times weights of mean one
    assert errors.model > 0.1


def test_a_model_that_knows_what_is_to_come_has_no_error_and_its_copy_is_of_the_latent_before_the_chunk(batch):
    """With x_last for x the velocity is off by (x - x_last) / tau; in chunks of two, 1 and 2 copy 0, 3 and 4 copy 2.

    The second clip has four latents: nothing is counted in the fifth place of its row.
    """
    (part,) = training_inputs(batch, seed=0, flow_shift=5.0)
    rgb, tau = batch.rgb[:, 1:], part.inputs.flow_time[:, 1:]
    off = (rgb - batch.rgb[:, [0, 0, 2, 2]]) / tau[..., None, None, None].clamp(min=1e-3)
    noise = part.noise[:, 1:]
    wanted = flow_errors(noise - rgb + off, rgb, noise, tau, 5.0)
    errors = flow_matching_errors(true_velocity, [batch], seed=0, shift=5.0)
    assert errors.model == pytest.approx(0.0, abs=1e-6)
    assert errors.copy == pytest.approx(float(wanted[0].mean() * 4 / 7 + wanted[1, :3].mean() * 3 / 7), rel=1e-4)
