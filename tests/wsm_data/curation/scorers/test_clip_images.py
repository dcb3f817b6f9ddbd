import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.curation.scorers.clip_images import ClipImages, images_of


def test_latents_of_repeated_frames_are_left_out(make_clip):
    for padded, latents in ((0, 5), (3, 5), (4, 4), (7, 4), (8, 3), (15, 2), (16, 1)):
        images = images_of(make_clip(latents=5, padded_frames=padded), np.ones(48), None, 3)
        assert (len(images.rgb_latent), len(images.depth_valid)) == (latents, latents)


def test_depth_is_decoded_at_latents_spread_over_the_clip(make_clip):
    clip, codec = make_clip(latents=9), DctCodec()
    images = images_of(clip, np.ones(48), codec, 3)
    assert images.sampled.tolist() == [1, 4, 7]
    expected = codec.decode(clip.depth_latent[4:5].astype(np.float32))[0].mean(axis=-1)
    assert images.sampled_depth[1] == pytest.approx(expected, abs=1e-6)


def test_no_latent_is_decoded_twice_and_none_without_a_codec(make_clip):
    clip = make_clip(latents=2)
    assert images_of(clip, np.ones(48), DctCodec(), 10).sampled.tolist() == [0, 1]
    assert images_of(clip, np.ones(48), None, 10).sampled_depth.shape == (0, 96, 160)
    assert len(images_of(clip, np.ones(48), DctCodec(), 0).sampled) == 0


def test_arrays_that_do_not_belong_together_are_refused(make_images):
    images = make_images()
    with pytest.raises(ValueError, match="rgb_std"):
        ClipImages(**{**vars(images), "rgb_std": np.ones(3)})
