import numpy as np
import pytest

from wsm_data.codecs.clip_video import rgb_video
from wsm_data.codecs.dct import DctCodec
from wsm_data.errors import DataError, Reason
from wsm_model.agent.eye import Eye, Video


@pytest.fixture
def eye(standard, model):
    return Eye(DctCodec(), standard, model.config)


def frames(camera, count):
    rng = np.random.default_rng(0)
    return list(rng.integers(0, 256, (count, camera.height, camera.width, 3), dtype=np.uint8))


def test_latents_come_after_one_frame_and_then_after_every_fourth(eye, camera):
    video = Video()
    found = [eye.see(video, one, camera) is not None for one in frames(camera, 9)]
    assert found == [True, False, False, False, True, False, False, False, True]


def test_what_is_seen_frame_by_frame_is_to_the_bit_the_latents_of_the_whole_clip(eye, camera, standard):
    """The clip is made as the pipeline makes it: decoded, resized per axis, encoded, standardised."""
    pictures, video = frames(camera, 9), Video()
    seen = [latent for one in pictures if (latent := eye.see(video, one, camera)) is not None]
    clip = DctCodec().encode(rgb_video(pictures, 96, 64, "clip"))
    mean, scale = (
        np.array(one, np.float32)[:, None, None] for one in (standard.rgb_mean, 1 / np.array(standard.rgb_std))
    )
    assert np.array_equal(np.stack([one.numpy() for one in seen]), (clip - mean) * scale)


@pytest.mark.parametrize("shape", [(72, 127, 3), (72, 128, 4), (144, 256, 3)])
def test_a_frame_of_another_size_is_refused(eye, camera, shape):
    with pytest.raises(DataError, match="128x72 px") as caught:
        eye.see(Video(), np.zeros(shape, np.uint8), camera)
    assert caught.value.reason == Reason.FRAME_SIZE_MISMATCH


def test_a_dream_of_what_was_seen_decodes_to_pictures_of_it(eye, camera):
    """Flat colours survive the codec: 200 of 255 comes back within its rounding."""
    grey, video = np.full((camera.height, camera.width, 3), 200, np.uint8), Video()
    first, *rest = [latent for _ in range(9) if (latent := eye.see(video, grey, camera)) is not None]
    pictures = eye.pictures(first, rest[0][None])
    assert pictures.shape == (4, 64, 96, 3)
    assert np.abs(pictures.astype(int) - 200).max() <= 1
