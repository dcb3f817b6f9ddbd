"""Inference through the cache equals the teacher-forced pass, and episodes together equal each alone."""

from dataclasses import replace

import pytest
import torch

from wsm_data.schema.sequence import chunk_start
from wsm_model.config import Variant
from wsm_model.inference.passes import velocity
from wsm_model.inference.session import Session, SessionConfig, StateEstimate
from wsm_model.layers.pose import identity_poses

ROUNDING = 1e-5  # float32; the specification asks for 1e-4


def known_states(inputs, first: int, end: int) -> list[StateEstimate]:
    """The true states of some latents, of each row."""
    return [
        StateEstimate(first=first, depth=inputs.depth[row, first:end], poses=inputs.poses[row, first:end])
        for row in range(len(inputs.rgb))
    ]


def assert_close(found: torch.Tensor, wanted: torch.Tensor) -> None:
    torch.testing.assert_close(found, wanted, rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_states_of_whole_chunks_equal_those_of_the_single_pass(make_model, make_inputs, make_spans, chunk_size):
    frames = 1 + 2 * chunk_size
    model, inputs = make_model(), make_inputs(make_spans([frames, frames], [chunk_size, chunk_size]))
    with torch.no_grad():
        wanted = model(inputs)
    session = Session(model, SessionConfig(chunk_size=chunk_size, cache_latents=frames + 1))
    episodes = [session.start(), session.start()]
    for latent in range(frames):
        first = chunk_start(latent, chunk_size)
        found = session.observe(episodes, inputs.rgb[:, latent], known_states(inputs, first, latent + 1))
        for row, states in enumerate(found):
            assert states.first == first
            assert len(states.poses) == latent + 1 - first
            if latent % chunk_size == 0:  # the chunk is whole: the local backend has seen all that training saw
                place = slice(first, latent + 1)
                assert_close(states.depth, wanted.depth[row, place])
                if latent:
                    assert_close(states.poses, wanted.poses[row, place])


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_the_first_velocity_of_a_dream_equals_that_of_the_single_pass(make_model, make_inputs, make_spans, chunk_size):
    frames = 1 + 2 * chunk_size
    spans = make_spans([frames, frames], [chunk_size, chunk_size])
    model, inputs = make_model(), make_inputs(spans, flow_time=torch.ones(2, frames))
    first = 1 + chunk_size
    session = Session(model, SessionConfig(chunk_size=chunk_size, cache_latents=frames + 1))
    episodes = [session.start(), session.start()]
    with torch.no_grad():
        wanted = model(inputs).velocity[:, first:]
        for latent in range(first):
            start = chunk_start(latent, chunk_size)
            session.observe(episodes, inputs.rgb[:, latent], known_states(inputs, start, latent + 1))
        context = model.goal(inputs.goal_camera0_m)[:, None, None].expand(-1, chunk_size, -1, -1)
        histories = [one.history for one in episodes]
        found = velocity(model, histories, inputs.noisy_rgb[:, first:], 1.0, context)
    assert_close(found, wanted)


def test_the_pose_of_the_anchor_is_the_identity_in_what_is_said_and_in_what_is_remembered(
    make_model, make_inputs, make_spans
):
    """As in training, which shows every later chunk the exact identity: a history that is told so is the same."""
    model, inputs = make_model(), make_inputs(make_spans([2], [1]))
    session = Session(model, SessionConfig(chunk_size=1, cache_latents=8))
    estimating, told = session.start(), session.start()
    (anchor,) = session.observe([estimating], inputs.rgb[:, 0])
    assert torch.equal(anchor.poses, identity_poses(1, 4))
    session.observe([told], inputs.rgb[:, 0], [replace(anchor, poses=identity_poses(1, 4))])
    (one,), (other,) = (session.observe([episode], inputs.rgb[:, 1]) for episode in (estimating, told))
    assert torch.equal(one.poses, other.poses)
    assert not torch.equal(one.poses, identity_poses(1, 4))


@pytest.mark.parametrize("local_backend", [True, False])
def test_episodes_of_different_lengths_together_equal_each_alone(make_model, make_inputs, make_spans, local_backend):
    """One begins later, one is reset on the way, and one has a full cache."""
    model, inputs = make_model(), make_inputs(make_spans([9, 9, 9], [3, 3, 3]))
    session = Session(model, SessionConfig(chunk_size=3, cache_latents=5, local_backend=local_backend))
    noise = torch.randn(3, 2, 3, *inputs.rgb.shape[2:], generator=torch.Generator().manual_seed(5))
    starts = {0: 0, 1: 2, 2: 5}  # the third is reset at 5
    together, alone = [session.start() for _ in range(3)], [session.start() for _ in range(3)]
    for latent in range(9):
        if latent == starts[2]:
            together[2], alone[2] = session.start(), session.start()
        rows = [row for row in range(3) if latent >= starts[row] or row == 2]
        found = session.observe([together[row] for row in rows], inputs.rgb[rows, latent])
        for row, states in zip(rows, found, strict=True):
            (wanted,) = session.observe([alone[row]], inputs.rgb[row : row + 1, latent])
            assert states.first == wanted.first
            assert_close(states.poses, wanted.poses)
            assert_close(states.depth, wanted.depth)
    assert [one.observed for one in together] == [9, 7, 4]
    dreams = session.dream(together, inputs.goal_camera0_m, noise, [1.0, 0.5, 0.0])
    for row, dream in enumerate(dreams):
        (wanted,) = session.dream(
            [alone[row]], inputs.goal_camera0_m[row : row + 1], noise[row : row + 1], [1.0, 0.5, 0.0]
        )
        assert dream.first == wanted.first == together[row].observed
        for name in ("rgb", "depth", "poses"):
            assert_close(getattr(dream, name), getattr(wanted, name))


def test_many_dreams_of_one_history_equal_one_after_the_other(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([3], [2]))
    session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
    episode = session.start()
    for latent in range(3):
        session.observe([episode], inputs.rgb[:, latent])
    noise = torch.randn(1, 5, 2, *inputs.rgb.shape[2:], generator=torch.Generator().manual_seed(5))
    (dream,) = session.dream([episode], inputs.goal_camera0_m, noise, [1.0, 0.5, 0.0])
    assert dream.rgb.shape == noise.shape[1:]
    assert dream.poses.shape == (5, 2, 4, 7)
    for number in range(5):
        (wanted,) = session.dream([episode], inputs.goal_camera0_m, noise[:, number : number + 1], [1.0, 0.5, 0.0])
        assert_close(dream.rgb[number], wanted.rgb[0])
        assert_close(dream.depth[number], wanted.depth[0])
        assert_close(dream.poses[number], wanted.poses[0])
    assert (dream.rgb[0] - dream.rgb[1]).abs().max() > 0.1


def test_a_dream_leaves_the_history_as_it_was(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([6], [2]))
    session, states = Session(model, SessionConfig(chunk_size=2, cache_latents=8)), []
    for dreams in (False, True):
        episode = session.start()
        for latent in range(6):
            (found,) = session.observe([episode], inputs.rgb[:, latent])
            if dreams:
                session.dream([episode], inputs.goal_camera0_m, inputs.noisy_rgb[:, None, :2], [1.0, 0.5, 0.0])
        states.append(found)
    assert torch.equal(states[0].poses, states[1].poses)
    assert torch.equal(states[0].depth, states[1].depth)


def test_without_the_local_backend_each_latent_is_estimated_once(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([5], [4]))
    session = Session(model, SessionConfig(chunk_size=4, cache_latents=8, local_backend=False))
    episode = session.start()
    for latent in range(5):
        (states,) = session.observe([episode], inputs.rgb[:, latent])
        assert (states.first, len(states.poses)) == (latent, 1)


def test_a_full_cache_drops_the_oldest_latents_and_keeps_the_anchor(make_model, make_inputs, make_spans):
    """After many latents the cache equals that of a history which never held what was dropped."""
    frames, kept = 40, 4
    model, inputs = make_model(layers=1), make_inputs(make_spans([frames], [1]))
    keys = []
    for limit in (kept, frames + 1):
        session = Session(model, SessionConfig(chunk_size=1, cache_latents=limit))
        episode = session.start()
        for latent in range(frames):
            session.observe([episode], inputs.rgb[:, latent], known_states(inputs, latent, latent + 1))
        held = episode.history.rgb
        assert held.next == frames
        assert sorted(held.numbers) == [0, *range(max(1, frames - limit + 1), frames)]
        read = episode.history.read(0, held.held, 0).keys.transpose(0, 1).unflatten(0, (held.held, -1)).flip(0)
        keys.append(dict(zip(held.numbers, read, strict=True)))
    for number, kept_keys in keys[0].items():  # one layer: keys depend on their own latent alone
        torch.testing.assert_close(kept_keys, keys[1][number])


@pytest.mark.parametrize("limit", [20, 6])
def test_latents_taken_in_by_chunks_equal_one_after_the_other(make_model, make_inputs, make_spans, limit):
    """Also from the middle of a chunk on, and where the cache is full and latents are dropped on the way."""
    model, inputs = make_model(), make_inputs(make_spans([12], [3]))
    session = Session(model, SessionConfig(chunk_size=3, cache_latents=limit))
    one, all_at_once = session.start(), session.start()
    estimates = [session.observe([one], inputs.rgb[:, latent])[0] for latent in range(12)]
    session.observe_all(all_at_once, inputs.rgb[0, :3])
    found = session.observe_all(all_at_once, inputs.rgb[0, 3:])
    assert found.first == 1
    assert_close(found.poses, torch.cat([estimates[latent].poses for latent in (3, 6, 9, 11)]))
    assert_close(found.depth, torch.cat([estimates[latent].depth for latent in (3, 6, 9, 11)]))
    noise = inputs.noisy_rgb[:, None, :2]
    dreams = [session.dream([each], inputs.goal_camera0_m, noise, [1.0, 0.0])[0] for each in (one, all_at_once)]
    assert_close(dreams[0].poses, dreams[1].poses)


def test_states_that_are_remembered_must_be_those_of_the_current_chunk(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([3], [2]))
    session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
    episode = session.start()
    for latent in range(2):
        session.observe([episode], inputs.rgb[:, latent])
    with pytest.raises(ValueError, match="latents 1 to 2 are to be remembered"):
        session.observe([episode], inputs.rgb[:, 2], known_states(inputs, 2, 3))


def test_without_slam_the_poses_of_observed_latents_must_be_given(make_model, make_inputs, make_spans):
    model, inputs = make_model(Variant.IDM), make_inputs(make_spans([3], [1]))
    session = Session(model, SessionConfig(chunk_size=2, cache_latents=8))
    episode = session.start()
    (anchor,) = session.observe([episode], inputs.rgb[:, 0])
    assert torch.equal(anchor.poses, identity_poses(1, 4))
    (dream,) = session.dream([episode], inputs.goal_camera0_m, inputs.noisy_rgb[:, None, :2], [1.0, 0.0])
    assert dream.depth is None
    assert dream.poses.shape == (1, 2, 4, 7)
    with pytest.raises(ValueError, match="latent 1 needs the poses that were issued"):
        session.observe([episode], inputs.rgb[:, 1])


def test_a_dream_before_the_first_observation_is_refused(make_model, make_inputs, make_spans):
    inputs = make_inputs(make_spans([3], [1]))
    session = Session(make_model(), SessionConfig())
    with pytest.raises(ValueError, match="at least one observed latent"):
        session.dream([session.start()], inputs.goal_camera0_m, inputs.noisy_rgb[:, None, :2], [1.0, 0.0])
