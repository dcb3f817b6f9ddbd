"""Frames of keys and values, kept and dropped, and read as one stretch of memory."""

import pytest
import torch

from wsm_model.inference.cache import History, KeysValues, Places, Side


def frames(first: int, count: int, tokens: int) -> KeysValues:
    """Frames whose keys are filled with their numbers: [F, P, H, d]."""
    keys = torch.arange(first, first + count).float()[:, None, None, None].expand(count, tokens, 2, 12).clone()
    return KeysValues(keys, -keys)


def numbers(history: History, layer: int, rgb: int, states: int) -> list[float]:
    """Which frames a layer holds, one number a token; states are told from RGB by 100 more."""
    keys, values = history.read(layer, rgb, states)
    assert torch.equal(keys, -values)
    return sorted(keys[0, :, 0].tolist())


def push(history: History, config, frame: int) -> None:
    """Keep one more frame of either side."""
    history.make_room(1)
    for layer in range(config.layers):
        history.write(layer, Side.RGB, frames(frame, 1, 6))
        history.write(layer, Side.STATE, frames(100 + frame, 1, 10))
    history.rgb.keep(1)
    history.state.keep(1)


def test_what_is_kept_of_either_side_and_of_both_is_one_view_of_memory_for_the_limit_and_one_pass(config):
    """A frame has 6 RGB tokens, and 6 + 4 of state; the memory never grows."""
    history = History(config, limit=5, spare=2)
    for frame in range(12):
        push(history, config, frame)
        kept = [0, *range(max(1, frame - 3), frame + 1)]
        for layer in range(config.layers):
            assert numbers(history, layer, history.rgb.held, 0) == [one for one in kept for _ in range(6)]
            assert numbers(history, layer, 0, history.state.held) == [100 + one for one in kept for _ in range(10)]
            both = numbers(history, layer, history.rgb.held, history.state.held)
            assert len(both) == len(kept) * 16
        read = history.read(0, history.rgb.held, history.state.held).keys
        assert read.untyped_storage().nbytes() == (5 + 2) * 16 * 2 * 12 * 4
    assert history.rgb.next == history.state.next == 12


def test_frames_that_are_written_and_not_kept_stand_at_the_ends_and_are_written_over(config):
    history = History(config, limit=5, spare=2)
    push(history, config, 0)
    history.write(0, Side.RGB, frames(7, 2, 6))
    history.write(0, Side.STATE, frames(107, 2, 10))
    keys = history.read(0, 3, 3).keys[0, :, 0].tolist()
    assert keys == [8.0] * 6 + [7.0] * 6 + [0.0] * 6 + [100.0] * 10 + [107.0] * 10 + [108.0] * 10
    history.write(0, Side.RGB, frames(9, 1, 6))
    assert numbers(history, 0, 2, 0) == [0.0] * 6 + [9.0] * 6


def test_frames_that_are_forgotten_can_be_kept_again():
    places = Places(5)
    places.keep(4)
    places.forget_from(2)
    assert (places.numbers, places.next) == ([0, 1], 2)
    places.keep(3)
    assert places.numbers == [0, 1, 2, 3, 4]


def test_too_many_frames_a_gap_and_an_empty_memory_are_refused(config):
    places = Places(3)
    places.keep(3)
    with pytest.raises(ValueError, match="of at most 3"):
        places.keep(1)
    assert places.drop_oldest() == (2, 1)
    with pytest.raises(ValueError, match="must stand at the end"):
        places.forget_from(1)
    places.drop_oldest()
    with pytest.raises(ValueError, match="no frame to drop"):
        places.drop_oldest()
    with pytest.raises(ValueError, match="at least one frame"):
        Places(1)
    history = History(config, limit=3, spare=1)
    with pytest.raises(ValueError, match="written to before it is read"):
        history.read(0, 0, 0)
    with pytest.raises(ValueError, match="at most 1 frames"):
        history.write(0, Side.RGB, frames(0, 2, 6))
