from dataclasses import replace

import pytest

from wsm_data.errors import ConfigError
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.statistics import LatentStatistics

NO_STATISTICS = LatentStatistics(mean=(), std=(), count=0)


def test_latents_are_standardised_by_the_release_where_the_codec_says_nothing(tiny):
    found = latent_standard(tiny.manifest)
    assert (found.codec, found.codec_digest) == ("dct", "c0dec")
    assert (found.rgb_mean, found.rgb_std) == (tiny.manifest.rgb_statistics.mean, tiny.manifest.rgb_statistics.std)
    assert found.depth_mean == tiny.manifest.depth_statistics.mean
    assert found.depth_std == tiny.manifest.depth_statistics.std


def test_statistics_of_the_codec_come_before_those_of_the_release(tiny):
    mean, std = tuple(range(48)), (2.0,) * 48
    codec = replace(tiny.manifest.codec, latent_mean=mean, latent_std=std)
    found = latent_standard(replace(tiny.manifest, codec=codec))
    assert (found.rgb_mean, found.rgb_std) == (mean, std)
    assert found.depth_mean == tiny.manifest.depth_statistics.mean


def test_a_release_without_statistics_has_no_standard(tiny):
    with pytest.raises(ConfigError, match=r"release tiny must have latent statistics.*name a release with a split"):
        latent_standard(replace(tiny.manifest, rgb_statistics=NO_STATISTICS))


def test_a_release_without_depth_has_a_standard_of_colour_alone(tiny):
    found = latent_standard(replace(tiny.manifest, depth_statistics=NO_STATISTICS))
    assert (found.depth_mean, found.depth_std) == ((), ())
    assert found.rgb_mean == tiny.manifest.rgb_statistics.mean
