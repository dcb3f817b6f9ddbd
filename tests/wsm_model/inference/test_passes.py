"""Passes over the cache against the teacher-forced pass: states of a dream, and the variant without SLAM."""

import pytest
import torch

from wsm_model.config import Variant
from wsm_model.inference.cache import FrameCache, KeysValues
from wsm_model.inference.passes import History, States, clean_rgb, clean_states, query_states, velocity

ROUNDING = 1e-5  # float32; the specification asks for 1e-4


def histories_of(model, inputs, latents: int) -> list[History]:
    """All that is known of each row after some latents, with their true states."""
    rows, limit = range(len(inputs.rgb)), inputs.rgb.shape[1] + 1
    histories = [
        History(rgb=FrameCache(model.config.layers, limit), state=FrameCache(model.config.layers, limit)) for _ in rows
    ]
    depth = inputs.depth[:, :latents] if model.config.variant is Variant.SLAM else None
    states, firsts = States(depth=depth, poses=inputs.poses[:, :latents]), [0 for _ in rows]
    with torch.no_grad():
        rgb = clean_rgb(model, histories, inputs.rgb[:, :latents], firsts)
        state = clean_states(model, histories, states, firsts)
    for row in rows:
        for layer in range(model.config.layers):
            histories[row].rgb.write(layer, 0, KeysValues(*(part[row] for part in rgb[layer])))
            histories[row].state.write(layer, 0, KeysValues(*(part[row] for part in state[layer])))
    return histories


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
        wanted, histories = model(inputs), histories_of(model, inputs, first)
        context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, chunk_size, -1, -1)
        flow = velocity(model, histories, inputs.noisy_rgb[:, first:], 0.625, [first, first], context)
        dreamed = clean_rgb(model, histories, inputs.rgb[:, first:], [first, first])
        states = query_states(model, histories, [first, first], chunk_size, dreamed=dreamed, context=context)
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
        clean_states(model, histories, States(depth=None, poses=inputs.poses[:, 1:]), [1])


def test_without_slam_estimates_need_the_goal(make_model, make_inputs, make_spans):
    model, inputs = make_model(Variant.IDM), make_inputs(make_spans([2], [1]))
    histories = histories_of(model, inputs, 2)
    with pytest.raises(ValueError, match="see the goal: give its tokens as context"):
        query_states(model, histories, [1], 1)
