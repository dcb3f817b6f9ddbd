import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.fft import dctn

from wsm_data.codecs.dct import CHANNELS, DctCodec, coefficient_table

CODEC = DctCodec()
# float32 arithmetic on numbers up to 4: conversion of colours, a sum over 1024 pixels, and the way back.
ROUNDING = 5e-6


def test_the_table_is_every_coefficient_of_weighted_frequency_up_to_six():
    allowed = {
        (plane, t, y, x)
        for plane, weight in enumerate((1, 2, 2))
        for t in range(4)
        for y in range(16)
        for x in range(16)
        if weight * (1 + 2 * t + y + x) <= 6
    }
    table = [tuple(row) for row in coefficient_table().tolist()]
    assert len(table) == len(set(table)) == CHANNELS == 48
    assert set(table) == allowed
    assert table[0] == (0, 0, 0, 0)


def test_latents_are_the_scaled_orthonormal_coefficients_in_ycbcr(noise_video):
    latents = CODEC.encode(noise_video)
    red, green, blue = np.moveaxis(noise_video[1:5].astype(np.float64), -1, 0)
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    planes = (luma, (blue - luma) / 1.772, (red - luma) / 1.402)
    for channel, (plane, *frequency) in enumerate(coefficient_table().tolist()):
        block = dctn(planes[plane][:, 16:32, 48:64], norm="ortho")
        assert latents[1, channel, 1, 3] == pytest.approx(block[tuple(frequency)] / 8, abs=ROUNDING)


def test_the_shape_is_that_of_the_wan_vae():
    latents = CODEC.encode(np.zeros((9, 192, 320, 3), np.float32))
    assert latents.shape == (3, 48, 12, 20)
    assert latents.dtype == np.float32
    assert CODEC.decode(latents).shape == (9, 192, 320, 3)


def test_the_first_frame_is_encoded_as_if_held_for_four_frames(noise_video):
    held = np.concatenate([noise_video[:1]] * 5)
    latents = CODEC.encode(held)
    np.testing.assert_allclose(latents[0], latents[1], atol=ROUNDING)
    assert not latents[0, coefficient_table()[:, 1] > 0].any()


def test_a_still_video_means_the_same_latent_all_along_and_white_is_four():
    latents = CODEC.encode(np.ones((5, 32, 32, 3), np.float32))
    np.testing.assert_allclose(latents[:, 0], 4, atol=ROUNDING)
    np.testing.assert_allclose(latents[:, 1:], 0, atol=ROUNDING)


def test_a_prefix_of_a_video_has_a_prefix_of_its_latents_bit_for_bit(noise_video):
    whole = CODEC.encode(noise_video)
    for j in range(3):
        assert np.array_equal(CODEC.encode(noise_video[: 1 + 4 * j]), whole[: 1 + j])


def test_a_prefix_of_latents_is_decoded_to_a_prefix_of_the_video_bit_for_bit(noise_video):
    latents = CODEC.encode(noise_video)
    whole = CODEC.decode(latents)
    for j in range(3):
        assert np.array_equal(CODEC.decode(latents[: 1 + j]), whole[: 1 + 4 * j])


def test_a_latent_sees_nothing_later_and_nothing_earlier(noise_video):
    changed = noise_video.copy()
    changed[5:] *= -1
    whole, other = CODEC.encode(noise_video), CODEC.encode(changed)
    assert np.array_equal(whole[:2], other[:2])
    assert not np.array_equal(whole[2], other[2])


def test_many_are_encoded_as_each_alone_bit_for_bit(noise_video, smooth_video):
    together = CODEC.encode_many([noise_video, smooth_video])
    assert np.array_equal(together[0], CODEC.encode(noise_video))
    assert np.array_equal(together[1], CODEC.encode(smooth_video))


def test_grey_given_once_and_grey_given_three_times_agree_bit_for_bit(noise_video):
    view = np.broadcast_to(noise_video[..., :1], noise_video.shape)
    assert view.strides[-1] == 0
    once, thrice = CODEC.encode(view), CODEC.encode(np.ascontiguousarray(view))
    assert once.tobytes() == thrice.tobytes()


def test_memory_layout_does_not_change_a_bit(noise_video):
    transposed = np.ascontiguousarray(noise_video.transpose(3, 2, 1, 0)).transpose(3, 2, 1, 0)
    assert CODEC.encode(transposed).tobytes() == CODEC.encode(noise_video).tobytes()


_ENCODE_AND_DIGEST = """
import hashlib, numpy as np
from wsm_data.codecs.dct import DctCodec
video = np.random.default_rng(3).uniform(-1, 1, (9, 64, 64, 3)).astype(np.float32)
latents = DctCodec().encode(video)
print(hashlib.sha256(latents.tobytes() + DctCodec().decode(latents).tobytes()).hexdigest())
"""


def test_the_number_of_threads_does_not_change_a_bit():
    digests = set()
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, threads)}
        done = subprocess.run(
            [sys.executable, "-c", _ENCODE_AND_DIGEST], env=environment, capture_output=True, text=True, check=True
        )
        digests.add(done.stdout)
    assert len(digests) == 1


def test_decoding_gives_the_nearest_video_of_48_coefficients(noise_video):
    # The colour conversion is not orthogonal, so the projection property is that of the planes: encoding what was
    # decoded changes nothing. Small colours, so that the clamp has no part in it.
    latents = CODEC.encode(noise_video * 0.2)
    np.testing.assert_allclose(CODEC.encode(CODEC.decode(latents)), latents, atol=ROUNDING)


@settings(max_examples=30, deadline=None)
@given(colour=arrays(np.float32, 3, elements=st.floats(-1, 1, width=32)))
def test_every_colour_in_the_gamut_comes_back(colour):
    video = np.broadcast_to(colour, (5, 32, 32, 3)).astype(np.float32)
    np.testing.assert_allclose(CODEC.decode(CODEC.encode(video)), video, atol=ROUNDING)


def test_decoded_video_is_clamped():
    latents = np.zeros((2, 48, 2, 2), np.float32)
    latents[:, 0] = 40
    assert CODEC.decode(latents).max() == 1
    assert CODEC.decode(-latents).min() == -1


def test_decoding_latent_0_uses_only_what_a_held_frame_can_have():
    latents = np.zeros((1, 48, 2, 2), np.float32)
    latents[:, coefficient_table()[:, 1] > 0] = 1
    assert not CODEC.decode(latents).any()


def test_decoding_leaves_the_given_latents_as_they_are(noise_video):
    latents = CODEC.encode(noise_video)
    latents[0] = 1
    before = latents.copy()
    CODEC.decode(latents)
    assert np.array_equal(latents, before)


def test_a_smooth_video_survives_and_noise_does_not(smooth_video, noise_video):
    def error(video):
        return np.mean(np.square(CODEC.decode(CODEC.encode(video)) - video))

    assert error(smooth_video) < 1e-3  # 36 dB
    assert error(noise_video) > 0.3  # noise keeps 48 of 3072 numbers, of variance 1/3


def test_float16_costs_less_than_a_quarter_of_an_8_bit_step(smooth_video):
    latents = CODEC.encode(smooth_video)
    stored = latents.astype(np.float16).astype(np.float32)
    # Rounding errors of 48 coefficients add up in a pixel; the largest is 2^-10 of the block's constant, over 4.
    assert np.abs(CODEC.decode(stored) - CODEC.decode(latents)).max() < 0.25 * 2 / 255


@pytest.mark.parametrize("frames", [0, 2, 4, 8])
def test_another_length_than_1_plus_4k_is_refused(frames):
    with pytest.raises(ValueError, match=f"1 \\+ 4k frames, found {frames}"):
        CODEC.encode(np.zeros((frames, 32, 32, 3), np.float32))


@pytest.mark.parametrize("shape", [(1, 48, 32, 3), (1, 32, 16, 3), (1, 0, 32, 3)])
def test_sides_that_are_no_multiples_of_32_are_refused(shape):
    with pytest.raises(ValueError, match="multiples of 32"):
        CODEC.encode(np.zeros(shape, np.float32))


def test_another_dtype_is_refused():
    with pytest.raises(ValueError, match="float32"):
        CODEC.encode(np.zeros((1, 32, 32, 3)))


@pytest.mark.parametrize("shape", [(1, 16, 2, 2), (0, 48, 2, 2)])
def test_latents_of_another_codec_or_none_are_refused(shape):
    with pytest.raises(ValueError, match="latents"):
        CODEC.decode(np.zeros(shape, np.float32))


def test_it_describes_its_geometry_and_has_no_statistics_of_its_own():
    info = CODEC.describe()
    assert (info.name, info.channels, info.temporal_ratio, info.spatial_ratio) == ("dct", 48, 4, 16)
    assert info.latent_mean == info.latent_std == ()
    assert info.whitening == 0.5
    assert info.digest == DctCodec().describe().digest
    assert info.settings["coefficients"] == coefficient_table().tolist()


def test_the_digest_stands_for_these_bits(noise_video):
    # A release made earlier must stay comparable: when this fails, raise the version of the algorithm in the codec.

    latents = CODEC.encode(np.round(noise_video * 64) / 64)
    assert CODEC.describe().digest[:16] == "829106d82e93619a"
    assert hashlib.sha256(latents.tobytes()).hexdigest()[:16] == "46e790a2b187bd8a"


@pytest.mark.parametrize("is_grey", [False, True])
def test_a_video_that_comes_frame_by_frame_has_the_latents_of_the_whole_bit_for_bit(smooth_video, is_grey):
    codec, state, found = DctCodec(), None, []
    video = np.broadcast_to(smooth_video[..., :1], smooth_video.shape) if is_grey else smooth_video
    for frames in (video[:1], video[1:5], video[5:9], video[9:13]):
        latent, state = codec.encode_next(frames, state)
        state = codec.restored(state.arrays())
        found.append(latent)
    assert state.latents == 4
    assert np.array_equal(np.stack(found), codec.encode(video))


def test_frames_that_are_not_those_of_the_next_latent_are_refused(smooth_video):
    codec = DctCodec()
    with pytest.raises(ValueError, match="latent 0 of a video is made of 1 frames, found 4"):
        codec.encode_next(smooth_video[:4])
    _, state = codec.encode_next(smooth_video[:1])
    with pytest.raises(ValueError, match="latent 1 of a video is made of 4 frames, found 1"):
        codec.encode_next(smooth_video[1:2], state)
    with pytest.raises(ValueError, match="multiples of 32 px, found 90x64"):
        codec.encode_next(np.ascontiguousarray(smooth_video[1:5, :, :90]), state)
