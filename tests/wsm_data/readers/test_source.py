"""A source of another kind than files: what the programs ask of a reader is all that it needs."""

from dataclasses import replace
from itertools import chain

import numpy as np

from wsm_data.codecs.clip_video import depth_video, rgb_video
from wsm_data.readers.source import Container, ContainerScan, SourceReader
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.identity import EpisodeId

RGB = np.full((2, 32, 48, 3), 255, np.uint8)
CONTAINER = Container(id="memory", layout="arrays", signature="of two frames")


def record(number):
    return EpisodeRecord(
        id=EpisodeId("lab_cam", "room", f"{number:06d}"),
        container=CONTAINER.id,
        rgb_members=("0", "1"),
        depth_members=("0", ""),
        T_world_camera=np.tile(np.eye(4), (2, 1, 1)),
        intrinsics=Intrinsics(fx=40.0, fy=40.0, cx=23.5, cy=15.5, width=48, height=32),
        camera_height_m=1.0,
        camera_pitch_rad=0.0,
        frames_digest="",
        content_digest="",
    )


def scan(_root, _container, _dataset, _every):
    """Two episodes of one container, without a cloud."""
    return ContainerScan(
        records=(record(0), record(1)),
        refusals=(),
        cloud=None,
        cloud_refusal=None,
        depth_samples={},
        bytes_read=RGB.nbytes,
    )


def iter_frames(_root, _container, _dataset, records):
    """Pixels, not files; the second frame has no depth."""
    for one in records:
        yield one, EpisodeFrames(rgb=tuple(RGB), depth=(np.full((32, 48), 10_000, np.uint16), None))


MEMORY = SourceReader(
    name="memory",
    expects="nothing on disk",
    find_containers=lambda _root, _dataset: [CONTAINER],
    scan=scan,
    iter_frames=iter_frames,
)


def test_decoded_frames_and_frames_without_depth_become_videos(tmp_path, dataset):
    (container,) = MEMORY.find_containers(tmp_path, dataset)
    records = MEMORY.scan(tmp_path, container, dataset, 1).records
    episodes = list(MEMORY.iter_frames(tmp_path, container, replace(dataset, reader="memory"), records))
    assert [one.id.episode for one, _ in episodes] == ["000000", "000001"]
    for frames in chain(frames for _, frames in episodes):
        assert (rgb_video(frames.rgb, 48, 32, "memory") == 1.0).all()  # 255 / 127.5 - 1
        depth, valid = depth_video(frames.depth, dataset.depth, DepthRange(), 48, 32, "memory")
        assert valid[0].all()
        assert not valid[1].any()
        assert (depth[1] == 1.0).all()  # as a pixel without a measurement
        assert (depth[0] < 1.0).all()  # 10,000 x 1e-4 m = 1 m
