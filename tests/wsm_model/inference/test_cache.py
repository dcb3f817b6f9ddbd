"""Frames of keys and values, kept and dropped."""

import pytest
import torch

from wsm_model.inference.cache import FrameCache, KeysValues


def frame(number: int) -> KeysValues:
    """One frame, its keys filled with its number: [1, P, H, d]."""
    keys = torch.full((1, 3, 2, 4), float(number))
    return KeysValues(keys, -keys)


def numbers(cache: FrameCache, layer: int, before: int) -> list[float]:
    """Which frames a layer holds below `before`."""
    return [number for part in cache.read(layer, before) for number in part.keys[:, 0, 0, 0].tolist()]


def filled(layers: int, limit: int, frames: int) -> FrameCache:
    cache = FrameCache(layers, limit)
    for number in range(frames):
        if cache.held == limit:
            cache.drop_oldest()
        for layer in range(layers):
            cache.write(layer, number, frame(number))
    return cache


def test_frames_are_read_as_they_were_written_in_every_layer():
    cache = filled(2, 5, 4)
    assert numbers(cache, 0, 4) == numbers(cache, 1, 4) == [0, 1, 2, 3]
    assert numbers(cache, 1, 2) == [0, 1]
    assert numbers(cache, 0, 0) == []
    assert all(torch.equal(keys, -values) for keys, values in cache.read(0, 4))


def test_a_full_cache_drops_the_oldest_but_the_anchor_however_often():
    cache = filled(1, 4, 100)
    assert numbers(cache, 0, 100) == [0, 97, 98, 99]
    assert (cache.held, cache.dropped) == (4, 96)


def test_a_frame_can_be_written_again():
    cache = filled(1, 5, 3)
    cache.write(0, 1, frame(7))
    assert numbers(cache, 0, 3) == [0, 7, 2]


def test_frames_are_read_in_the_order_of_time_from_memory_of_their_number():
    for frames in range(1, 20):
        cache = filled(1, 6, frames)
        for before in range(max(1, frames - 5), frames + 1):
            if before > cache.dropped:
                wanted = [0, *range(cache.dropped + 1, before)]
                assert numbers(cache, 0, before) == wanted
        assert {part.keys.untyped_storage().nbytes() for part in cache.read(0, frames)} == {6 * 3 * 2 * 4 * 4}


def test_several_frames_are_written_at_once_also_across_the_end_of_the_memory():
    cache = filled(1, 5, 7)  # holds 0, 3, 4, 5, 6
    cache.drop_oldest()
    cache.drop_oldest()
    both = KeysValues(*(torch.cat(parts) for parts in zip(frame(7), frame(8), strict=True)))
    cache.write(0, 7, both)
    assert numbers(cache, 0, 9) == [0, 5, 6, 7, 8]


def test_a_gap_a_dropped_frame_and_one_too_many_are_refused():
    cache = filled(1, 3, 5)  # holds 0, 3, 4
    for number, match in ((7, "must follow"), (1, "was dropped"), (5, "of at most 3")):
        with pytest.raises(ValueError, match=match):
            cache.write(0, number, frame(number))
    with pytest.raises(ValueError, match="no frame to drop"):
        filled(1, 3, 1).drop_oldest()
