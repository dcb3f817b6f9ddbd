import cv2
import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.recorded import Recording, image_size, iter_recorded, scan_recording
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.source.motion import Motion

CAMERA = Intrinsics(fx=24.0, fy=24.0, cx=15.5, cy=11.5, width=32, height=24)
DATASET = DatasetManifest(
    name="own",
    licence="none",
    depth=DepthEncoding(metres_per_unit=1e-3, invalid_codes=(0,)),
    motion=Motion(floor_z_m=0.0),
)


def recording(folder, *, with_depth=True, depth_size=(24, 32)):
    rng = np.random.default_rng(0)
    for i in range(6):
        cv2.imwrite(str(folder / f"{i}.png"), rng.integers(0, 256, (24, 32, 3), dtype=np.uint8))
        cv2.imwrite(str(folder / f"d{i}.png"), rng.integers(500, 4000, depth_size).astype(np.uint16))
    T = np.tile(np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0.8], [0, 0, 0, 1]]), (6, 1, 1))  # level, along y
    T[:, 1, 3] = 0.1 * np.arange(6)
    names = tuple(f"{i}.png" for i in range(6))
    depth = tuple(f"d{name}" for name in names) if with_depth else ("",) * 6
    return Recording(
        container="c", group="own_cam", scene="s", rgb=names, depth=depth, T_world_camera=T, intrinsics=CAMERA
    )


def test_a_level_camera_stands_at_its_height_above_the_stated_floor(tmp_path):
    (record,) = scan_recording(tmp_path, recording(tmp_path), DATASET, 2).records
    assert (record.camera_height_m, record.camera_pitch_rad) == (0.8, 0.0)
    assert record.id.text == "own_cam/s/000000"


def test_frames_without_depth_have_none_in_both_passes(tmp_path):
    found = scan_recording(tmp_path, recording(tmp_path, with_depth=False), DATASET, 2)
    assert list(found.depth_samples.values()) == [()]
    ((_, frames),) = iter_recorded(tmp_path, found.records)
    assert list(frames.depth) == [None] * 6


def test_the_content_digest_goes_by_images_poses_camera_and_floor(tmp_path):
    one = recording(tmp_path)
    digests = {scan_recording(tmp_path, one, DATASET, 2).records[0].content_digest for _ in range(2)}
    assert len(digests) == 1
    moved = Recording(**{**vars(one), "T_world_camera": one.T_world_camera + np.eye(4)[3] * 0})
    assert scan_recording(tmp_path, moved, DATASET, 2).records[0].content_digest in digests
    depthless = recording(tmp_path, with_depth=False)
    assert scan_recording(tmp_path, depthless, DATASET, 2).records[0].content_digest not in digests


def test_depth_of_another_size_than_colour_is_refused_with_both(tmp_path):
    found = scan_recording(tmp_path, recording(tmp_path, depth_size=(12, 16)), DATASET, 2)
    (refusal,) = found.refusals
    assert refusal.reason is Reason.FRAME_SIZE_MISMATCH
    assert "32 x 24" in refusal.message
    assert "16 x 12" in refusal.message
    assert found.records == ()


def test_the_size_of_an_image_that_is_not_there_is_a_refusal(tmp_path):
    with pytest.raises(DataError) as caught:
        image_size(tmp_path, "gone.png", "c")
    assert caught.value.reason is Reason.FILE_UNREADABLE
