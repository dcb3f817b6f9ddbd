"""An episode record agrees with itself, and gives floor and path from its poses."""

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId


@pytest.fixture
def fields():
    T = np.tile(np.eye(4), (6, 1, 1))
    T[:, :3, 3] = np.column_stack([np.arange(6.0), np.arange(6.0) ** 2, np.full(6, 1.7)])
    return {
        "id": EpisodeId("gibson_zed", "Ackermanville", "000000"),
        "container": "gibson_zed/Ackermanville.tar.gz",
        "rgb_members": tuple(f"{n}.jpg" for n in range(6)),
        "depth_members": tuple(f"{n}.png" for n in range(6)),
        "T_world_camera": T,
        "intrinsics": Intrinsics(fx=300.0, fy=300.0, cx=240.0, cy=135.0, width=480, height=270),
        "camera_height_m": 0.5,
        "camera_pitch_rad": 0.1,
        "frames_digest": "0" * 32,
        "content_digest": "1" * 64,
    }


def test_the_floor_lies_a_mount_height_below_the_first_camera(fields):
    assert EpisodeRecord(**fields).floor_z_m == pytest.approx(1.2, abs=1e-15)


def test_the_path_is_the_cameras_over_the_floor(fields):
    record = EpisodeRecord(**fields)
    assert record.frame_count == 6
    assert record.path_xy_m.tolist() == [[0, 0], [1, 1], [2, 4], [3, 9], [4, 16], [5, 25]]


def test_poses_cannot_be_written_to(fields):
    assert not EpisodeRecord(**fields).T_world_camera.flags.writeable


def test_more_poses_than_images_are_refused(fields):
    with pytest.raises(ValueError, match=r"^T_world_camera must be float64 \[6, 4, 4\], found float64 \[12, 4, 4\]"):
        EpisodeRecord(**{**fields, "T_world_camera": np.tile(np.eye(4), (12, 1, 1))})


def test_single_precision_poses_are_refused(fields):
    with pytest.raises(ValueError, match=r"^T_world_camera must be float64"):
        EpisodeRecord(**{**fields, "T_world_camera": fields["T_world_camera"].astype(np.float32)})


def test_a_pose_that_is_not_finite_is_refused_with_its_index(fields):
    fields["T_world_camera"][3, 0, 3] = np.nan
    with pytest.raises(ValueError, match=r"^T_world_camera must be finite, found nan at index \[3, 0, 3\]"):
        EpisodeRecord(**fields)


def test_colour_and_depth_images_must_be_equally_many(fields):
    with pytest.raises(ValueError, match="gibson_zed/Ackermanville/000000: 6 colour images but 5 depth images"):
        EpisodeRecord(**{**fields, "depth_members": fields["depth_members"][:5]})
