"""Frames out of latents, with the codec of the tests of views: a clip whose pictures are known."""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

from wsm_data.clips.decoded import decode_video, valid_cells
from wsm_data.codecs.dct import DctCodec
from wsm_data.errors import ConfigError
from wsm_data.schema.depth import DepthRange

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from tiny_release import build_clip

FRAMES = 9
DCT_ERROR_U8 = 3  # of 255, where colours change over the whole width: higher frequencies are cut


@pytest.fixture
def seen() -> tuple[np.ndarray, DctCodec]:
    """A ramp of grey from -1 to 1 over the width; float32 [9, 96, 160, 3]."""
    video = np.broadcast_to(np.linspace(-1, 1, 160, dtype=np.float32)[:, None], (FRAMES, 96, 160, 3))
    return np.ascontiguousarray(video), DctCodec()


@pytest.fixture
def clip(seen):
    video, codec = seen
    latent = codec.encode(video).astype(np.float16)
    clip = build_clip(latents=3, codec_digest=codec.describe().digest)
    return dataclasses.replace(clip, rgb_latent=latent, depth_latent=latent)


def test_colour_and_metric_depth_come_back(clip, seen):
    decoded = decode_video(clip, seen[1])
    assert decoded.frames == tuple(range(FRAMES))
    assert (decoded.rgb.dtype, decoded.rgb.shape) == (np.dtype(np.uint8), (FRAMES, 96, 160, 3))
    assert np.abs(decoded.rgb - (seen[0] + 1) * 127.5).max() < DCT_ERROR_U8
    limits = DepthRange()
    u = (seen[0][..., 0] + 1) / 2
    depth_m = limits.min_m * (limits.max_m / limits.min_m) ** u  # inverse of u = log(d / min) / log(max / min)
    assert np.abs(np.log(decoded.depth_m / depth_m)).max() < 0.1


def test_some_frames_are_those_of_the_whole_video(clip, seen):
    whole, some = decode_video(clip, seen[1]), decode_video(clip, seen[1], (8, 0))
    np.testing.assert_array_equal(some.rgb, whole.rgb[[8, 0]])
    np.testing.assert_array_equal(some.measured, whole.measured[[8, 0]])
    with pytest.raises(IndexError):
        decode_video(clip, seen[1], (FRAMES,))


def test_a_clip_without_depth_has_none_measured(clip, seen):
    decoded = decode_video(dataclasses.replace(clip, depth_latent=None, depth_valid=None), seen[1], (0, 1))
    assert not decoded.depth_m.any()
    assert not decoded.measured.any()


def test_the_cells_of_a_frame_are_those_of_its_latent(clip):
    np.testing.assert_array_equal(valid_cells(clip, (0, 1, 4, 5, 8)), clip.depth_valid[[0, 1, 1, 2, 2]])


def test_a_clip_of_another_codec_is_not_decoded(clip, seen):
    other = dataclasses.replace(clip, meta=dataclasses.replace(clip.meta, codec_digest="another"))
    with pytest.raises(ConfigError, match="another"):
        decode_video(other, seen[1])


def test_it_is_shown_in_a_line(clip, seen):
    bare = dataclasses.replace(clip, depth_latent=None, depth_valid=None)
    said = repr(decode_video(bare, seen[1], (0,)))
    assert said == "<DecodedVideo: 1 frames of 160 x 96 px, depth measured in 0%>"
