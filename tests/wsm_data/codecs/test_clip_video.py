import cv2
import numpy as np
import pytest
import simplejpeg
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.codecs.clip_video import VideoMemory, depth_video, pad_frames, padded_length, rgb_video
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import log_depth_table, measured_table
from wsm_data.codecs.images import decode_rgb
from wsm_data.codecs.resize import resize_colour, resize_depth
from wsm_data.errors import DataError, Reason
from wsm_data.schema.depth import DepthEncoding, DepthRange

ENCODING = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
RANGE = DepthRange()
WHERE = "gibson_d435i/Adrian/000003"


def test_a_colour_video_is_the_resized_frames_over_minus_one_to_one(rgb_frames):
    video = rgb_video(rgb_frames, 64, 32, WHERE)
    assert video.dtype == np.float32
    assert video.shape == (3, 32, 64, 3)
    for t, data in enumerate(rgb_frames):
        wanted = np.empty((32, 64, 3), np.float32)
        resize_colour(decode_rgb(data, WHERE), wanted)
        assert np.array_equal(video[t], wanted)


@pytest.mark.parametrize(("level", "value"), [(0, -1), (255, 1)])
def test_black_and_white_are_the_ends_of_the_range_exactly(level, value):
    data = simplejpeg.encode_jpeg(np.full((32, 32, 3), level, np.uint8))
    assert (rgb_video([data], 32, 32, WHERE) == value).all()


def test_a_depth_video_is_the_table_of_the_nearest_codes(depth_frames, depth_images):
    video, valid = depth_video(depth_frames, ENCODING, RANGE, 64, 32, WHERE)
    for t, raw in enumerate(depth_images):
        wanted, measured = np.empty((32, 64), np.float32), np.empty((32, 64), bool)
        resize_depth(raw, log_depth_table(ENCODING, RANGE), measured_table(ENCODING), wanted, measured)
        for channel in range(3):
            assert np.array_equal(video[t, ..., channel], wanted)
        assert np.array_equal(valid[t], measured)


def test_pixels_without_measurement_are_far_and_not_valid(depth_frames):
    video, valid = depth_video(depth_frames, ENCODING, RANGE, 96, 64, WHERE)
    assert 0 < (~valid).sum() < valid.size
    assert (video[~valid] == 1).all()


def test_a_depth_video_holds_its_channel_once(depth_frames):
    video, _ = depth_video(depth_frames, ENCODING, RANGE, 64, 32, WHERE)
    assert video.strides[-1] == 0
    assert not video.flags.writeable


def test_a_frame_of_another_size_is_refused_by_number(rgb_frames):
    smaller = simplejpeg.encode_jpeg(np.zeros((48, 96, 3), np.uint8))
    with pytest.raises(DataError, match=f"{WHERE}, colour frame 2.*found 96x48 px after 96x54 px") as caught:
        rgb_video([*rgb_frames[:2], smaller], 64, 32, WHERE)
    assert caught.value.reason is Reason.FRAME_SIZE_MISMATCH
    assert caught.value.details == {"frame": 2, "size_px": [96, 48]}


def test_a_depth_frame_of_another_size_is_refused_by_number(depth_frames):
    larger = cv2.imencode(".png", np.ones((54, 97), np.uint16))[1].tobytes()
    with pytest.raises(DataError, match="depth frame 1") as caught:
        depth_video([depth_frames[0], larger], ENCODING, RANGE, 64, 32, WHERE)
    assert caught.value.reason is Reason.FRAME_SIZE_MISMATCH


def test_a_frame_that_does_not_decode_is_refused_by_number(rgb_frames, depth_frames):
    with pytest.raises(DataError, match=f"{WHERE}, colour frame 1") as caught:
        rgb_video([rgb_frames[0], rgb_frames[1][:200], rgb_frames[2]], 64, 32, WHERE)
    assert caught.value.reason is Reason.FRAME_UNDECODABLE
    with pytest.raises(DataError, match=f"{WHERE}, depth frame 2") as caught:
        depth_video([*depth_frames[:2], b""], ENCODING, RANGE, 64, 32, WHERE)
    assert caught.value.reason is Reason.FRAME_UNDECODABLE


@pytest.mark.parametrize(("frames", "still", "wanted"), [(1, 16, 17), (2, 16, 21), (5, 16, 21), (169, 16, 185)])
def test_the_padded_length_of_known_cases(frames, still, wanted):
    assert padded_length(frames, still) == wanted


@given(frames=st.integers(1, 2000), still=st.integers(0, 8).map(lambda k: 4 * k))
def test_the_padded_length_is_the_shortest_1_plus_4k_with_the_still_frames(frames, still):
    length = padded_length(frames, still)
    assert length % 4 == 1
    assert 0 <= length - still - frames < 4


@pytest.mark.parametrize(("frames", "still"), [(0, 16), (5, 3), (5, -4)])
def test_no_frames_or_part_of_a_latent_of_stillness_is_refused(frames, still):
    with pytest.raises(ValueError, match="multiple of 4"):
        padded_length(frames, still)


def test_padding_repeats_the_last_frame(smooth_video):
    padded = pad_frames(smooth_video, 17)
    assert np.array_equal(padded[:13], smooth_video)
    assert all(np.array_equal(frame, smooth_video[-1]) for frame in padded[13:])


def test_padding_a_mask_keeps_its_type():
    padded = pad_frames(np.array([[[True, False]]]), 5)
    assert padded.dtype == bool
    assert padded.tolist() == [[[True, False]]] * 5


def test_a_padded_depth_video_still_holds_its_channel_once(depth_frames):
    video, _ = depth_video(depth_frames, ENCODING, RANGE, 64, 32, WHERE)
    padded = pad_frames(video, 5)
    assert padded.strides[-1] == 0
    materialised = pad_frames(np.ascontiguousarray(video), 5)
    assert np.array_equal(padded, materialised)
    assert np.array_equal(DctCodec().encode(padded), DctCodec().encode(materialised))


def test_padding_to_less_is_refused(smooth_video):
    with pytest.raises(ValueError, match="found 13"):
        pad_frames(smooth_video, 9)


def test_memory_that_is_used_again_gives_the_same_videos_for_longer_and_shorter_episodes(rgb_frames, depth_frames):
    memory = VideoMemory()
    for count in (3, 2, 3):
        rgb = rgb_video(rgb_frames[:count], 64, 32, WHERE, 5, memory)
        depth, valid = depth_video(depth_frames[:count], ENCODING, RANGE, 64, 32, WHERE, 5, memory)
        assert np.array_equal(rgb, rgb_video(rgb_frames[:count], 64, 32, WHERE, 5))
        fresh_depth, fresh_valid = depth_video(depth_frames[:count], ENCODING, RANGE, 64, 32, WHERE, 5)
        assert np.array_equal(depth, fresh_depth)
        assert np.array_equal(valid, fresh_valid)


def test_memory_is_one_until_a_longer_episode_comes(rgb_frames):
    memory = VideoMemory()
    first = rgb_video(rgb_frames[:3], 64, 32, WHERE, None, memory)
    second = rgb_video(rgb_frames[:2], 64, 32, WHERE, None, memory)
    assert np.shares_memory(first, second)
