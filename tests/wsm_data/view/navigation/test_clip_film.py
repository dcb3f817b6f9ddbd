import cv2
import numpy as np
import pytest

from wsm_data.clips.decoded import decode_video
from wsm_data.errors import ConfigError
from wsm_data.view.clip.facts import world_path_m
from wsm_data.view.drawing.depth_colours import depth_picture
from wsm_data.view.navigation.clip_film import clip_film_frames, write_clip_film


def test_colour_depth_and_way_of_a_frame_are_of_the_same_moment(clip, made):
    decoded = decode_video(clip, made.codec)
    frames = list(clip_film_frames(clip, made.codec))
    assert len(frames) == clip.meta.recorded_frames == clip.frame_count - clip.meta.padded_frames
    for number, frame in enumerate(frames):
        depth_u8 = depth_picture(decoded.depth_m[number], clip.meta.depth_range, decoded.measured[number])
        assert np.array_equal(frame.seen_u8, decoded.rgb[number])
        assert np.array_equal(frame.beside_u8, depth_u8)
        assert np.array_equal(frame.true_m, world_path_m(clip)[: number + 1, :2])
        assert frame.caption[1] == f"frame {number + 1} of {len(frames)}"


def test_the_film_of_a_clip_has_its_recorded_frames(clip, made, tmp_path):
    path = tmp_path / "clip.mp4"
    assert write_clip_film(clip, made.codec, path) == clip.meta.recorded_frames
    reader = cv2.VideoCapture(str(path))
    assert int(reader.get(cv2.CAP_PROP_FRAME_COUNT)) == clip.meta.recorded_frames
    assert reader.read()[1].shape == (720, 960, 3)


def test_a_clip_of_another_codec_leaves_no_film(clip, made, tmp_path):
    other = type(clip.meta)(**{**vars(clip.meta), "codec_digest": "0" * 64})
    foreign = type(clip)(meta=other, **clip.arrays())
    with pytest.raises(ConfigError, match="only that decodes it"):
        write_clip_film(foreign, made.codec, tmp_path / "clip.mp4")
    assert list(tmp_path.iterdir()) == []
