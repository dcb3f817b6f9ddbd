"""Passes over the cache against the teacher-forced pass: states of a dream, and the variant without SLAM."""

import pytest
import torch

from wsm_model.config import Variant
from wsm_model.inference.cache import FrameCache
from wsm_model.inference.passes import History, StateEstimate, query_states, velocity, write_rgb, write_states

ROUNDING = 1e-5  # float32; the specification asks for 1e-4


def history_of(model, inputs, latents: int) -> History:
    """All that is known after some latents, with their true states."""
    limit = inputs.rgb.shape[1] + 1
    history = History(rgb=FrameCache(model.config.layers, limit), state=FrameCache(model.config.layers, limit))
    depth = inputs.depth[:, :latents] if model.config.variant is Variant.SLAM else None
    write_rgb(model, history, inputs.rgb[:, :latents], 0)
    write_states(model, history, StateEstimate(first=0, depth=depth, poses=inputs.poses[:, :latents]))
    return history


@pytest.mark.parametrize("variant", Variant)
@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_a_dream_and_its_states_equal_those_of_the_single_pass(
    make_model, make_inputs, make_spans, chunk_size, variant
):
    """The dreamed latents are those that training shows as clean RGB; without SLAM their poses see the goal."""
    frames, first = 1 + 2 * chunk_size, 1 + chunk_size
    spans = make_spans([frames, frames], [chunk_size, chunk_size])
    model, inputs = make_model(variant), make_inputs(spans, flow_time=torch.full((2, frames), 0.625))
    with torch.no_grad():
        wanted, history = model(inputs), history_of(model, inputs, first)
        context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, chunk_size, -1, -1)
        flow = velocity(model, history, inputs.noisy_rgb[:, first:], 0.625, first, context)
        write_rgb(model, history, inputs.rgb[:, first:], first)
        states = query_states(model, history, first, chunk_size, 2, context)
    torch.testing.assert_close(flow, wanted.velocity[:, first:], rtol=ROUNDING, atol=ROUNDING)
    torch.testing.assert_close(states.poses, wanted.poses[:, first:], rtol=ROUNDING, atol=ROUNDING)
    if variant is Variant.IDM:
        assert states.depth is None
    else:
        torch.testing.assert_close(states.depth, wanted.depth[:, first:], rtol=ROUNDING, atol=ROUNDING)


def test_states_that_lack_depth_are_refused_by_a_model_with_slam(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([2], [1]))
    history = history_of(model, inputs, 1)
    with pytest.raises(ValueError, match="need depth latents beside their poses"):
        write_states(model, history, StateEstimate(first=1, depth=None, poses=inputs.poses[:, 1:]))


def test_without_slam_estimates_need_the_goal(make_model, make_inputs, make_spans):
    model, inputs = make_model(Variant.IDM), make_inputs(make_spans([2], [1]))
    history = history_of(model, inputs, 2)
    with pytest.raises(ValueError, match="see the goal: give its tokens as context"):
        query_states(model, history, 1, 1, 1)
