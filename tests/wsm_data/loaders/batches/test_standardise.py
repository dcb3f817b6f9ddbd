import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import LATENT_DTYPES
from wsm_data.loaders.batches.standardise import Standardisation, convert, standardisations
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.statistics import LatentStatistics

CHANNELS = 3
MEAN, STD = np.array([0.25, -3.0, 100.0]), np.array([1e-6, 0.7, 33.0])


def _standardisation() -> Standardisation:
    mean, scale = (torch.from_numpy(values.astype(np.float32)).view(-1, 1, 1) for values in (MEAN, 1 / STD))
    return Standardisation(mean=mean, scale=scale)


def _expected(stored: np.ndarray, dtype: torch.dtype) -> torch.Tensor:
    """The formula in numpy: float32, one operation after the other, rounded once to the dtype."""
    mean, scale = (values.astype(np.float32)[:, None, None] for values in (MEAN, 1 / STD))
    return torch.from_numpy((stored.astype(np.float32) - mean) * scale).to(dtype)


@given(
    stored=hnp.arrays(
        np.float16,
        st.tuples(st.integers(0, 4), st.just(CHANNELS), st.integers(1, 3), st.integers(1, 3)),
        elements=st.floats(-60000, 60000, width=16),
    ),
    dtype=st.sampled_from(list(LATENT_DTYPES.values())),
)
def test_it_is_the_formula_to_the_bit_for_all_numbers(stored, dtype):
    out = torch.empty(stored.shape, dtype=dtype)
    convert(torch.from_numpy(stored), out, _standardisation())
    assert torch.equal(out, _expected(stored, dtype))


@pytest.mark.parametrize("dtype", LATENT_DTYPES.values(), ids=str)
@pytest.mark.parametrize("latents", [1, 4, 5, 31])
def test_long_clips_are_done_in_blocks_without_a_seam(latents, dtype):
    """A latent of 3 x 60 x 50 = 9,000 numbers: three make a block."""
    stored = np.random.default_rng(0).normal(size=(latents, CHANNELS, 60, 50)).astype(np.float16)
    out = torch.empty(stored.shape, dtype=dtype)
    convert(torch.from_numpy(stored), out, _standardisation())
    assert torch.equal(out, _expected(stored, dtype))


@pytest.mark.parametrize("dtype", LATENT_DTYPES.values(), ids=str)
def test_a_device_gets_the_same_numbers(dtype):
    stored = np.random.default_rng(1).normal(size=(2, 4, CHANNELS, 6, 5)).astype(np.float16)
    found = _standardisation().whole(torch.from_numpy(stored), dtype)
    assert torch.equal(found, _expected(stored, dtype))


def test_the_number_of_threads_of_torch_changes_nothing():
    stored = torch.from_numpy(np.random.default_rng(2).normal(size=(9, CHANNELS, 96, 80)).astype(np.float16))
    results = []
    for threads in (1, 2, 4):
        before = torch.get_num_threads()
        torch.set_num_threads(threads)
        try:
            out = torch.empty(stored.shape)
            convert(stored, out, _standardisation())
        finally:
            torch.set_num_threads(before)
        results.append(out)
    assert torch.equal(results[0], results[1])
    assert torch.equal(results[0], results[2])


def test_no_thread_is_started():
    """Torch keeps a pool of threads for each thread that gives it long operations; they show under /proc."""
    stored, counts = torch.ones((40, CHANNELS, 96, 80), dtype=torch.float16), []

    def work() -> None:
        before = len(list(Path("/proc/self/task").iterdir()))
        convert(stored, torch.empty(stored.shape), _standardisation())
        counts.append(len(list(Path("/proc/self/task").iterdir())) - before)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert counts == [0]


def test_without_moments_only_the_dtype_changes():
    stored = torch.randn((5, CHANNELS, 4, 4)).half()
    out = torch.empty(stored.shape)
    convert(stored, out, None)
    assert torch.equal(out, stored.float())


def test_depth_has_the_statistics_of_the_release_and_colour_those_of_its_codec_where_it_has_some(released):
    manifest = released.release.manifest
    with_own = replace(manifest, codec=replace(manifest.codec, latent_mean=(1.0,) * 48, latent_std=(4.0,) * 48))
    for given_manifest, mean, std in [
        (manifest, manifest.rgb_statistics.mean, manifest.rgb_statistics.std),
        (with_own, [1.0] * 48, [4.0] * 48),
    ]:
        found = standardisations(given_manifest)
        np.testing.assert_array_equal(found["rgb"].mean.flatten(), np.float32(mean))
        np.testing.assert_array_equal(found["rgb"].scale.flatten(), np.float32(1 / np.array(std)))
        np.testing.assert_array_equal(found["depth"].mean.flatten(), np.float32(manifest.depth_statistics.mean))


def test_a_release_without_training_clips_cannot_be_standardised(released):
    empty = LatentStatistics(count=0, mean=(), std=())
    manifest = replace(released.release.manifest, depth_statistics=empty, rgb_statistics=empty)
    with pytest.raises(ConfigError, match=r"must have latent statistics to standardise by.*standardise = false"):
        standardisations(manifest)


def test_a_given_standard_stands_before_that_of_the_release_and_must_be_of_its_codec(released):
    manifest = released.release.manifest
    own = latent_standard(manifest)
    given_one = replace(own, rgb_mean=(7.0,) * 48, depth_std=(2.0,) * 48)
    found = standardisations(manifest, standard=given_one)
    np.testing.assert_array_equal(found["rgb"].mean.flatten(), np.float32([7.0] * 48))
    np.testing.assert_array_equal(found["depth"].scale.flatten(), np.float32([0.5] * 48))
    with pytest.raises(ConfigError, match="cannot be standardised by the numbers of dct"):
        standardisations(manifest, standard=replace(own, codec="dct", codec_digest="0"))
