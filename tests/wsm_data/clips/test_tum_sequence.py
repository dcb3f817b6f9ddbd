import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from wsm_data.clips.decoded import decode_video
from wsm_data.clips.tum_sequence import write_tum_sequence
from wsm_data.codecs.images import decode_depth, decode_rgb
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.readers.tum.scan import read_recording
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from walled_release import CODEC, FRAMES, PADDED, build_clip

DEPTH = DepthEncoding(metres_per_unit=1 / 5000, invalid_codes=(0,))
BENCHMARK = DatasetManifest(name="exported", reader="tum", licence="none", camera_axes="opencv", depth=DEPTH)


@pytest.fixture(scope="module")
def sequence(tmp_path_factory):
    """The folder, the clip, and what it decodes to at its moving frames."""
    folder, clip = tmp_path_factory.mktemp("exported") / "scene", build_clip()
    decoded = decode_video(clip, CODEC, range(FRAMES - PADDED))
    write_tum_sequence(folder, clip, decoded)
    return folder, clip, decoded


def test_the_reader_of_the_benchmark_finds_every_frame_its_pose_and_the_camera(sequence):
    folder, clip, decoded = sequence
    found = read_recording(folder, "scene", BENCHMARK)
    wanted = clip.meta.T_world_camera0_matrix @ transforms_from_vectors(clip.poses[: FRAMES - PADDED])
    assert len(found.rgb) == len(found.depth) == len(decoded.frames)
    assert np.abs(found.T_world_camera - wanted).max() < 1e-4
    assert found.intrinsics == clip.intrinsics


def test_colour_is_kept_to_the_bit_and_depth_to_half_a_step(sequence):
    folder, _, decoded = sequence
    found = read_recording(folder, "scene", BENCHMARK)
    assert decoded.measured.any()
    for number, (rgb, depth) in enumerate(zip(found.rgb, found.depth, strict=True)):
        assert np.array_equal(decode_rgb((folder / rgb).read_bytes(), rgb), decoded.rgb[number])
        depth_m = decode_depth((folder / depth).read_bytes(), depth) / 5000
        wanted = np.where(decoded.measured[number], decoded.depth_m[number], 0)
        assert np.abs(depth_m - wanted).max() <= 0.5 / 5000 + 1e-9


def test_associations_name_files_that_are_there(sequence):
    folder, clip, decoded = sequence
    lines = [line.split() for line in (folder / "associations.txt").read_text().splitlines()]
    assert len(lines) == len(decoded.frames)
    for stamp, rgb, again, depth in lines:
        assert stamp == again
        assert cv2.imread(str(folder / rgb)).shape[:2] == cv2.imread(str(folder / depth), -1).shape
    assert json.loads((folder / "camera.json").read_text())["width"] == clip.intrinsics.width


def test_a_clip_without_depth_has_a_sequence_of_colour_alone(sequence, tmp_path):
    _, clip, _ = sequence
    arrays = {name: array for name, array in clip.arrays().items() if not name.startswith("depth")}
    blind = type(clip)(meta=clip.meta, **arrays)
    write_tum_sequence(tmp_path, blind, decode_video(blind, CODEC, range(3)))
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        "camera.json",
        "camera.txt",
        "groundtruth.txt",
        "rgb",
        "rgb.txt",
    ]
