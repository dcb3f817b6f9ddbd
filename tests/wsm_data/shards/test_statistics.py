import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.files.json_values import from_json, to_json
from wsm_data.schema.clip import Clip
from wsm_data.shards.statistics import (
    STD_FLOOR,
    LatentSums,
    clip_sums,
    latent_statistics,
    latent_sums,
    merge_sums,
    real_latents,
)


def _latent(frames: int, seed: int = 0, mean: float = 2.0) -> np.ndarray:
    return np.random.default_rng(seed).normal(mean, 0.5, (frames, 3, 4, 5)).astype(np.float16)


def test_sums_are_those_of_exact_arithmetic() -> None:
    latent = _latent(6)
    sums = latent_sums(latent)
    for channel in range(3):
        values = latent[:, channel].astype(float).ravel().tolist()
        mean = math.fsum(values) / len(values)
        deviations = math.fsum((value - mean) ** 2 for value in values)
        assert sums.count == len(values)
        assert sums.mean[channel] == pytest.approx(mean, rel=1e-14)  # 120 float64 roundings
        assert sums.squared_deviations[channel] == pytest.approx(deviations, rel=1e-13)


@pytest.mark.parametrize("memory", [np.ascontiguousarray, np.asfortranarray])
def test_sums_are_added_in_one_order_whatever_the_memory_layout(memory: Callable[[np.ndarray], np.ndarray]) -> None:
    latent = _latent(4)
    sums = latent_sums(memory(latent))
    total = np.zeros(3)
    for frame in latent.astype(float):
        for row in frame.transpose(1, 2, 0):
            for cell in row:
                total = total + cell
    assert list(sums.mean) == (total / sums.count).tolist()  # to the bit: the order is part of the format


@given(st.lists(st.integers(1, 6), min_size=1, max_size=5), st.integers(0, 2**32 - 1))
def test_merged_sums_are_the_sums_of_everything(frames: list[int], seed: int) -> None:
    latents = [_latent(count, seed + number) for number, count in enumerate(frames)]
    merged = merge_sums(latent_sums(latent) for latent in latents)
    whole = latent_sums(np.concatenate(latents))
    assert merged is not None
    assert merged.count == whole.count
    np.testing.assert_allclose(merged.mean, whole.mean, rtol=1e-13)
    np.testing.assert_allclose(merged.squared_deviations, whole.squared_deviations, rtol=1e-12)


def test_a_mean_far_above_the_deviation_does_not_eat_it() -> None:
    # around 30000 float16 has steps of 16: a sum of squares in float64 would still do, one in float32 would not
    latent = (30000 + 16 * np.random.default_rng(0).integers(0, 2, (50, 1, 8, 8))).astype(np.float16)
    statistics = latent_statistics(merge_sums([latent_sums(latent[:25]), latent_sums(latent[25:])]))
    assert statistics.std[0] == pytest.approx(float(latent.astype(float).std()), rel=1e-12)


def test_a_constant_channel_gets_the_floor_instead_of_zero() -> None:
    statistics = latent_statistics(latent_sums(np.full((2, 1, 3, 3), 7, np.float16)))
    assert (statistics.mean, statistics.std) == ((7.0,), (STD_FLOOR,))


def test_nothing_counted_gives_empty_statistics() -> None:
    statistics = latent_statistics(merge_sums([]))
    assert (statistics.count, statistics.mean, statistics.std) == (0, (), ())


def test_sums_survive_json_to_the_bit() -> None:
    sums = latent_sums(_latent(3))
    assert from_json(LatentSums, json.loads(json.dumps(to_json(sums)))) == sums


@pytest.mark.parametrize(("padded", "real"), [(0, 5), (1, 5), (3, 5), (4, 4), (7, 4), (8, 3), (15, 2), (16, 1)])
def test_a_latent_counts_while_one_of_its_frames_is_real(padded: int, real: int) -> None:
    covered = [{0}] + [set(range(4 * j - 3, 4 * j + 1)) for j in range(1, 5)]  # 17 frames, 5 latents
    assert sum(bool(frames & set(range(17 - padded))) for frames in covered) == real
    assert real_latents(17, padded) == real


def test_a_clip_of_padding_alone_is_a_bug() -> None:
    with pytest.raises(ValueError, match="0 to 16 padded"):
        real_latents(17, 17)


def test_latents_of_padding_do_not_count(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip(latents=5, padded_frames=9)
    rgb, depth = clip_sums(clip)
    assert rgb.count == depth.count == 3 * 6 * 10
    assert rgb.mean == latent_sums(clip.rgb_latent[:3]).mean
    assert depth.mean == latent_sums(clip.depth_latent[:3]).mean
