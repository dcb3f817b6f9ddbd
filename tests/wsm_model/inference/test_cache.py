"""Frames of keys and values, kept and dropped."""

import pytest
import torch

from wsm_model.inference.cache import FrameCache


def frame(number: int, rows: int = 1) -> torch.Tensor:
    """Keys of one frame, filled with its number: [B, 1, P, H, d]."""
    return torch.full((rows, 1, 3, 2, 4), float(number))


def numbers(cache: FrameCache, layer: int, before: int) -> list[float]:
    """Which frames a layer holds below `before`."""
    found = cache.read(layer, before)
    return [] if found is None else found[0][0, :, 0, 0, 0].tolist()


def filled(layers: int, limit: int, frames: int) -> FrameCache:
    cache = FrameCache(layers, limit)
    for number in range(frames):
        if cache.held == limit:
            cache.drop_oldest()
        for layer in range(layers):
            cache.write(layer, number, frame(number), -frame(number))
    return cache


def test_frames_are_read_as_they_were_written_in_every_layer():
    cache = filled(2, 5, 4)
    assert numbers(cache, 0, 4) == numbers(cache, 1, 4) == [0, 1, 2, 3]
    assert numbers(cache, 1, 2) == [0, 1]
    assert numbers(cache, 0, 0) == []
    keys, values = cache.read(0, 4)
    assert torch.equal(keys, -values)


def test_a_full_cache_drops_the_oldest_but_the_anchor_also_beyond_its_slack():
    cache = filled(1, 4, 100)
    assert numbers(cache, 0, 100) == [0, 97, 98, 99]
    assert (cache.held, cache.dropped) == (4, 96)


def test_a_frame_can_be_written_again():
    cache = filled(1, 5, 3)
    cache.write(0, 1, frame(7), frame(7))
    assert numbers(cache, 0, 3) == [0, 7, 2]


def test_what_was_forgotten_is_written_anew():
    cache = filled(1, 5, 4)
    cache.forget_from(2)
    assert cache.held == 2
    cache.write(0, 2, frame(9), frame(9))
    assert numbers(cache, 0, 3) == [0, 1, 9]


def test_a_gap_a_dropped_frame_and_one_too_many_are_refused():
    cache = filled(1, 3, 5)  # holds 0, 3, 4
    for number, match in ((7, "must follow"), (1, "was dropped"), (5, "of at most 3")):
        with pytest.raises(ValueError, match=match):
            cache.write(0, number, frame(number), frame(number))
    with pytest.raises(ValueError, match="no frame to drop"):
        filled(1, 3, 1).drop_oldest()
