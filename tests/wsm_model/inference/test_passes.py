"""Passes over the cache against the teacher-forced pass: states of a dream, and the variant without SLAM."""

from dataclasses import replace

import pytest
import torch

from wsm_model.config import Prediction, Variant
from wsm_model.inference.cache import History
from wsm_model.inference.passes import States, clean_rgb, clean_states, query_states, velocity

ROUNDING = 1e-5  # float32; the specification asks for 1e-4


def histories_of(model, inputs, latents: int) -> list[History]:
    """All that is known of each row after some latents, with their true states."""
    frames = inputs.rgb.shape[1]
    histories = [History(model.config, limit=frames + 1, spare=frames) for _ in inputs.rgb]
    depth = inputs.depth[:, :latents] if model.config.variant is Variant.SLAM else None
    with torch.no_grad():
        clean_rgb(model, histories, inputs.rgb[:, :latents])
        clean_states(model, histories, States(depth=depth, poses=inputs.poses[:, :latents]))
    for history in histories:
        history.rgb.keep(latents)
        history.state.keep(latents)
    return histories


@pytest.mark.parametrize("prediction", Prediction)
@pytest.mark.parametrize("variant", Variant)
@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_a_dream_and_its_states_equal_those_of_the_single_pass(
    make_model, make_inputs, make_spans, chunk_size, variant, prediction
):
    """The dreamed latents are those that training shows as clean RGB; without SLAM their poses see the goal."""
    frames, first = 1 + 2 * chunk_size, 1 + chunk_size
    spans = make_spans([frames, frames], [chunk_size, chunk_size])
    model = make_model(variant, prediction=prediction)
    inputs = make_inputs(spans, flow_time=torch.full((2, frames), 0.625))
    with torch.no_grad():
        wanted, histories = model(inputs), histories_of(model, inputs, first)
        context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, chunk_size, -1, -1)
        flow = velocity(model, histories, inputs.noisy_rgb[:, first:], 0.625, context)
        dreamed = clean_rgb(model, histories, inputs.rgb[:, first:])
        states = query_states(model, histories, chunk_size, dreamed=dreamed, context=context)
    torch.testing.assert_close(flow, wanted.velocity[:, first:], rtol=ROUNDING, atol=ROUNDING)
    torch.testing.assert_close(states.poses, wanted.poses[:, first:], rtol=ROUNDING, atol=ROUNDING)
    if variant is Variant.IDM:
        assert states.depth is None
    else:
        torch.testing.assert_close(states.depth, wanted.depth[:, first:], rtol=ROUNDING, atol=ROUNDING)


def test_states_that_lack_depth_are_refused_by_a_model_with_slam(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([2], [1]))
    histories = histories_of(model, inputs, 1)
    with pytest.raises(ValueError, match="need depth latents beside their poses"):
        clean_states(model, histories, States(depth=None, poses=inputs.poses[:, 1:]))


def test_without_slam_estimates_need_the_goal(make_model, make_inputs, make_spans):
    model, inputs = make_model(Variant.IDM), make_inputs(make_spans([2], [1]))
    histories = histories_of(model, inputs, 1)
    with pytest.raises(ValueError, match="see the goal: give its tokens as context"):
        query_states(model, histories, 1)


def test_gradients_through_a_velocity_are_those_of_the_single_pass(make_model, make_inputs, make_spans):
    """Of the noisy latents, and of the weights that turn velocities out: the history itself is taken as given."""
    spans = make_spans([5], [2])
    model, inputs = make_model(), make_inputs(spans, flow_time=torch.full((1, 5), 0.625))
    histories = histories_of(model, inputs, 3)
    whole, chunk = (tensor.clone().requires_grad_() for tensor in (inputs.noisy_rgb, inputs.noisy_rgb[:, 3:]))
    context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, 2, -1, -1)
    model(replace(inputs, noisy_rgb=whole)).velocity[:, 3:].square().sum().backward()
    wanted = model.experts["generation"].head.projection.weight.grad.clone()
    model.zero_grad()
    velocity(model, histories, chunk, 0.625, context).square().sum().backward()
    torch.testing.assert_close(chunk.grad, whole.grad[:, 3:], rtol=1e-4, atol=ROUNDING)
    found = model.experts["generation"].head.projection.weight.grad
    torch.testing.assert_close(found, wanted, rtol=1e-4, atol=1e-4)
