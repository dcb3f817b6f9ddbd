from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.shards.latent_standard import channel_scales, latent_standard
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


@pytest.mark.parametrize("whitening", [0.0, 0.5, 1.0])
def test_channels_have_the_mean_variance_1_and_shares_of_it_by_the_exponent(whitening):
    std = (4.0, 2.0, 1.0)
    variances = np.square(np.array(std) / channel_scales(std, whitening))
    assert variances.mean() == pytest.approx(1.0)
    assert variances[0] / variances[2] == pytest.approx(4.0 ** (2 - 2 * whitening))


def test_whole_whitening_divides_by_the_deviations_to_the_bit():
    std = (0.1, 0.7)
    assert channel_scales(std, 1.0) is std
    assert channel_scales((), 0.5) == ()


def test_the_codec_says_how_far_its_channels_are_evened_out(tiny):
    manifest = replace(tiny.manifest, codec=replace(tiny.manifest.codec, settings={"whitening": 0.5}))
    found = latent_standard(manifest)
    assert found.rgb_std == channel_scales(manifest.rgb_statistics.std, 0.5)
    assert found.depth_std == channel_scales(manifest.depth_statistics.std, 0.5)
    assert found.rgb_mean == manifest.rgb_statistics.mean
