import numpy as np
import pytest
import torch

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import ReadConfig, SourceConfig
from wsm_data.loaders.reading.clip_filler import ClipFiller
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.timing import Timing


def _standardised(stored: np.ndarray, mean: tuple[float, ...], std: tuple[float, ...]) -> np.ndarray:
    column = (slice(None), None, None)
    centred = stored.astype(np.float32) - np.array(mean).astype(np.float32)[column]
    return centred * (1 / np.array(std)).astype(np.float32)[column]


@pytest.mark.parametrize("dtype", ["float32", "bfloat16", "float16"])
@pytest.mark.parametrize("threads", [0, 2])
def test_latents_are_standardised_to_the_bit_and_padding_stays_zero(
    released, make_loader, expected_batch, dtype, threads
):
    manifest = released.release.manifest
    moments = {"rgb": manifest.rgb_statistics, "depth": manifest.depth_statistics}
    for batch in make_loader(dtype=dtype, threads=threads):
        expected = expected_batch(batch, released.clips)
        for name, statistics in moments.items():
            values = _standardised(expected.pop(name), statistics.mean, statistics.std)
            values[expected["sequence_id"] < 0] = 0
            assert torch.equal(getattr(batch, name), torch.from_numpy(values).to(getattr(torch, dtype)))


def test_without_standardising_only_the_dtype_changes(released, make_loader, expected_batch):
    for batch in make_loader(standardise=False, dtype="float32"):
        expected = expected_batch(batch, released.clips)
        assert torch.equal(batch.rgb, torch.from_numpy(expected["rgb"]).float())


def test_a_dtype_that_latents_cannot_have_is_refused(released):
    sources = open_sources([SourceConfig(release=str(released.folder))])
    with pytest.raises(ConfigError, match="dtype must be one of float32, bfloat16, float16, found 'int8'"):
        ClipFiller(sources, ReadConfig(dtype="int8"), [], Timing())
