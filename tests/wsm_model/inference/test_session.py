"""Inference through the cache equals the teacher-forced pass, latent by latent."""

import pytest
import torch

from wsm_model.config import Variant
from wsm_model.inference.passes import StateEstimate, velocity
from wsm_model.inference.session import Session, SessionConfig

ROUNDING = 1e-5  # float32; the specification asks for 1e-4


def known_states(inputs, first: int, end: int) -> StateEstimate:
    """The true states of some latents."""
    return StateEstimate(first=first, depth=inputs.depth[:, first:end], poses=inputs.poses[:, first:end])


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_states_of_whole_chunks_equal_those_of_the_single_pass(make_model, make_inputs, make_spans, chunk_size):
    frames = 1 + 2 * chunk_size
    model, inputs = make_model(), make_inputs(make_spans([frames, frames], [chunk_size, chunk_size]))
    with torch.no_grad():
        wanted = model(inputs)
    session = Session(model, SessionConfig(chunk_size=chunk_size, cache_latents=frames + 1))
    for latent in range(frames):
        first = 1 + (latent - 1) // chunk_size * chunk_size if latent else 0
        states = session.observe(inputs.rgb[:, latent], known_states(inputs, first, latent + 1))
        assert states.first == first
        assert states.poses.shape[1] == latent + 1 - first
        if latent % chunk_size == 0:  # the chunk is whole: the local backend has seen all that training saw
            place = slice(first, latent + 1)
            torch.testing.assert_close(states.depth, wanted.depth[:, place], rtol=ROUNDING, atol=ROUNDING)
            torch.testing.assert_close(states.poses, wanted.poses[:, place], rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_the_first_velocity_of_a_dream_equals_that_of_the_single_pass(make_model, make_inputs, make_spans, chunk_size):
    frames = 1 + 2 * chunk_size
    spans = make_spans([frames, frames], [chunk_size, chunk_size])
    model, inputs = make_model(), make_inputs(spans, flow_time=torch.ones(2, frames))
    first = 1 + chunk_size
    session = Session(model, SessionConfig(chunk_size=chunk_size, cache_latents=frames + 1))
    with torch.no_grad():
        wanted = model(inputs).velocity[:, first:]
        for latent in range(first):
            start = 1 + (latent - 1) // chunk_size * chunk_size if latent else 0
            session.observe(inputs.rgb[:, latent], known_states(inputs, start, latent + 1))
        context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, chunk_size, -1, -1)
        found = velocity(model, session._history, inputs.noisy_rgb[:, first:], 1.0, first, context)
    torch.testing.assert_close(found, wanted, rtol=ROUNDING, atol=ROUNDING)


def test_a_dream_leaves_the_history_as_it_was(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([6], [2]))
    states = []
    for dreams in (False, True):
        session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
        for latent in range(6):
            found = session.observe(inputs.rgb[:, latent])
            if dreams:
                session.dream(inputs.goal_camera0_m, inputs.noisy_rgb[:, :2], [1.0, 0.5, 0.0])
        states.append(found)
    assert torch.equal(states[0].poses, states[1].poses)
    assert torch.equal(states[0].depth, states[1].depth)


def test_without_the_local_backend_each_latent_is_estimated_once(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([5], [4]))
    session = Session(model, SessionConfig(chunk_size=4, cache_latents=8, local_backend=False))
    for latent in range(5):
        states = session.observe(inputs.rgb[:, latent])
        assert (states.first, states.poses.shape[1]) == (latent, 1)


def test_a_full_cache_drops_the_oldest_latents_and_keeps_the_anchor(make_model, make_inputs, make_spans):
    """After many latents the estimate equals that of a history which never held what was dropped."""
    frames, kept = 40, 4
    model, inputs = make_model(layers=1), make_inputs(make_spans([frames], [1]))
    session = Session(model, SessionConfig(chunk_size=1, cache_latents=kept))
    for latent in range(frames):
        session.observe(inputs.rgb[:, latent], known_states(inputs, latent, latent + 1))
    assert (session._history.rgb.held, session._history.rgb.dropped) == (kept, frames - kept)
    keys, _ = session._history.rgb.read(0, frames)
    whole = Session(model, SessionConfig(chunk_size=1, cache_latents=frames + 1))
    for latent in range(frames):
        whole.observe(inputs.rgb[:, latent], known_states(inputs, latent, latent + 1))
    all_keys, _ = whole._history.rgb.read(0, frames)
    wanted = torch.cat([all_keys[:, :1], all_keys[:, frames - kept + 1 :]], dim=1)
    torch.testing.assert_close(keys, wanted)  # one layer: keys depend on their own latent alone


def test_without_slam_the_poses_of_observed_latents_must_be_given(make_model, make_inputs, make_spans):
    model, inputs = make_model(Variant.IDM), make_inputs(make_spans([3], [1]))
    session = Session(model, SessionConfig(chunk_size=1, cache_latents=8))
    session.observe(inputs.rgb[:, 0])
    with pytest.raises(ValueError, match="latent 1 needs the poses that were issued"):
        session.observe(inputs.rgb[:, 1])
    dream = session.dream(inputs.goal_camera0_m, inputs.noisy_rgb[:, :2], [1.0, 0.0])
    assert dream.states.depth is None
    assert dream.states.poses.shape == (1, 2, 4, 7)


def test_a_dream_before_the_first_observation_is_refused(make_model, make_inputs, make_spans):
    inputs = make_inputs(make_spans([3], [1]))
    with pytest.raises(ValueError, match="at least one observed latent"):
        Session(make_model(), SessionConfig()).dream(inputs.goal_camera0_m, inputs.noisy_rgb[:, :2], [1.0, 0.0])
