import pytest

from wsm_data.schema.frames import EpisodeFrames


def test_a_frame_may_be_without_depth_but_not_without_its_place():
    frames = EpisodeFrames(rgb=(b"a", b"b"), depth=(None, b"d"))
    assert [image is None for image in frames.depth] == [True, False]
    with pytest.raises(ValueError, match="one place for depth, found 2 and 1"):
        EpisodeFrames(rgb=(b"a", b"b"), depth=(b"d",))
