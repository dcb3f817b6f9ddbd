"""A data set of two episodes, of one clip twice, and what was put into it."""

import sys
from pathlib import Path

import pytest

from wsm_data.clips.decoded import decode_video

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))


@pytest.fixture(scope="session")
def clip():
    from walled_release import build_clip

    return build_clip()


@pytest.fixture(scope="session")
def decoded(clip):
    from walled_release import CODEC

    return decode_video(clip, CODEC, range(clip.meta.recorded_frames))


@pytest.fixture(scope="session")
def written(clip, decoded, tmp_path_factory):
    pytest.importorskip("av", reason="the extra lerobot is not installed")
    from wsm_data.clips.lerobot.writer import LerobotWriter
    from wsm_data.readers.lerobot.depth_codes import DepthQuantisation

    root = tmp_path_factory.mktemp("lerobot") / "set"
    quantisation = DepthQuantisation(depth_min=0.01, depth_max=10.0, shift=3.5, use_log=True)
    writer = LerobotWriter(root, size=(clip.intrinsics.width, clip.intrinsics.height), quantisation=quantisation)
    for _ in range(2):
        writer.add(clip, decoded)
    writer.finish({"test": 1, "train": 1})
    return root
