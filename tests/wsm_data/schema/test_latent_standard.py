import numpy as np

from wsm_data.schema.latent_standard import LatentStandard


def test_what_was_standardised_becomes_what_it_was_channel_by_channel():
    """Two channels; numbers that float32 holds exactly."""
    standard = LatentStandard(
        codec="dct",
        codec_digest="d",
        rgb_mean=(1.0, -2.0),
        rgb_std=(2.0, 0.5),
        depth_mean=(0.0, 8.0),
        depth_std=(4.0, 1.0),
    )
    latents = np.ones((3, 2, 1, 2), np.float32)
    assert standard.raw_rgb(latents)[2, :, 0, 1].tolist() == [3.0, -1.5]
    assert standard.raw_depth(latents)[0, :, 0, 0].tolist() == [4.0, 9.0]
    assert standard.raw_rgb(latents).dtype == np.float32


def test_standardising_is_the_way_back():
    standard = LatentStandard(
        codec="dct", codec_digest="d", rgb_mean=(1.0,), rgb_std=(2.0,), depth_mean=(0.0,), depth_std=(1.0,)
    )
    assert standard.standard_rgb(np.full((1, 1, 1), 5.0, np.float32)).tolist() == [[[2.0]]]
    assert standard.raw_rgb(np.full((1, 1, 1), 2.0, np.float32)).tolist() == [[[5.0]]]
