"""What the reader makes of a sequence, held against the files by means of its own: numpy, OpenCV and the truth."""

import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes
from wsm_data.errors import DataError, Reason
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.tum.listing import StampedFiles
from wsm_data.readers.tum.scan import mutual_pairs, read_recording, scan_sequence
from wsm_data.readers.tum.sequences import find_containers
from wsm_data.schema.source.motion import Motion


@pytest.fixture(scope="module")
def tum():
    return load_dataset("tum_rgbd")


@pytest.fixture(scope="module")
def whole(tum):
    """The manifest without thinning."""
    return replace(tum, motion=replace(tum.motion, min_step_m=0.0, min_turn_deg=0.0, max_frames=0))


def scan(source, dataset):
    (container,) = find_containers(source, dataset)
    return scan_sequence(source, container, dataset, 3)


def stamps_of(record):
    return np.array([float(name.removeprefix("rgb/").removesuffix(".png")) for name in record.rgb_members])


def test_poses_are_the_true_ones_and_frames_without_depth_are_left_out(hand_held, whole):
    source, truth = hand_held
    (record,) = scan(source, whole).records
    assert np.allclose(stamps_of(record), truth.stamps_s[truth.with_depth], atol=1e-6)
    expected = truth.T_world_camera[truth.with_depth]
    assert np.abs(record.T_world_camera - expected).max() < 2e-5  # six digits in the file
    assert record.notes == (Reason.SEQUENCE_UNASSOCIATED.value,)


def test_camera_and_depth_scale_are_those_of_the_files(hand_held, whole):
    source, _ = hand_held
    folder = source / "rgbd_dataset_home"
    (record,) = scan(source, whole).records
    fx, fy, cx, cy = np.loadtxt(folder / "camera.txt")
    assert np.array_equal(record.intrinsics.matrix, [[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    png = cv2.imread(str(folder / record.depth_members[7]), cv2.IMREAD_UNCHANGED)
    assert (record.intrinsics.height, record.intrinsics.width) == png.shape
    read = depth_m_from_raw(depth_codes((folder / record.depth_members[7]).read_bytes(), "d"), whole.depth)
    assert np.allclose(read, png / 5000.0, atol=1e-6)


def test_height_and_pitch_are_those_of_the_first_frame_above_the_floor_that_depth_shows(hand_held, whole):
    source, truth = hand_held
    (record,) = scan(source, whole).records
    assert record.floor_z_m == pytest.approx(0.0, abs=0.01)  # homes stand on z = 0
    assert record.camera_height_m == pytest.approx(truth.T_world_camera[0, 2, 3], abs=0.01)
    assert np.rad2deg(record.camera_pitch_rad) == pytest.approx(15, abs=0.1)  # as the camera was held
    stated = replace(whole, motion=replace(whole.motion, floor_z_m=-0.25))
    assert scan(source, stated).records[0].floor_z_m == pytest.approx(-0.25)


def test_kept_frames_moved_five_centimetres_or_turned_five_degrees(hand_held, tum):
    source, _ = hand_held
    (record,) = scan(source, tum).records
    step_m = np.linalg.norm(np.diff(record.T_world_camera[:, :3, 3], axis=0), axis=1)
    rotations = record.T_world_camera[:, :3, :3]
    cosine = (np.einsum("nij,nij->n", rotations[:-1], rotations[1:]) - 1) / 2
    turn_deg = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
    assert ((step_m >= 0.05) | (turn_deg >= 5)).all()
    assert step_m.max() < 0.05 + 3 * 0.03  # beyond the limit by a step of the walk, and two without depth


def test_a_long_recording_is_cut_into_trajectories_and_samples_go_with_each(hand_held, whole):
    source, _ = hand_held
    found = scan(source, replace(whole, motion=Motion(carried_by="hand", max_frames=40)))
    assert [record.frame_count for record in found.records] == [32, 32, 32]
    assert [record.id.text for record in found.records] == [f"tum_rgbd_own/rgbd_dataset_home/{n:06d}" for n in range(3)]
    assert [index for index, _ in found.depth_samples[found.records[2].id.text]] == list(range(0, 32, 3))


def test_a_damaged_image_costs_only_its_own_trajectory(hand_held, whole, tmp_path):
    source, _ = hand_held
    shutil.copytree(source, tmp_path / "copy")
    name = read_recording(tmp_path / "copy" / "rgbd_dataset_home", "c", whole).rgb[3]
    path = tmp_path / "copy" / "rgbd_dataset_home" / name
    path.write_bytes(path.read_bytes()[:-20])
    found = scan(tmp_path / "copy", replace(whole, motion=Motion(carried_by="hand", max_frames=40)))
    assert [(one.reason, one.unit[-6:]) for one in found.refusals] == [(Reason.FRAME_TRUNCATED, "000000")]
    assert len(found.records) == 2


def test_clocks_that_never_meet_are_refused_with_both(hand_held, whole, tmp_path):
    source, _ = hand_held
    shutil.copytree(source, tmp_path / "copy")
    path = tmp_path / "copy" / "rgbd_dataset_home" / "groundtruth.txt"
    path.write_text("5.0 0 0 0 0 0 0 1\n5.01 0 0 0 0 0 0 1\n")
    with pytest.raises(DataError, match="are they of one clock") as caught:
        scan(tmp_path / "copy", whole)
    assert caught.value.reason is Reason.SEQUENCE_UNASSOCIATED


def test_no_depth_image_is_used_twice():
    """At 30 Hz a depth image may be within 20 ms of two colour images: the nearer has it."""
    rgb = StampedFiles(stamps_s=np.array([0.0, 0.033, 0.066]), names=("a", "b", "c"))
    depth = StampedFiles(stamps_s=np.array([0.015, 0.070]), names=("x", "y"))
    assert [pair.tolist() for pair in mutual_pairs(rgb, depth, 0.02)] == [[0, 2], [0, 1]]
    assert [pair.tolist() for pair in mutual_pairs(rgb, depth, 0.01)] == [[2], [1]]
