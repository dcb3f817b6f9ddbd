"""A trajectory against its cloud and its images, in an analytic room."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, HALL, along_x, cloud_points, frames_of, record_of

from wsm_data.checks.gate import require_kept
from wsm_data.clips.build import read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.episode_gate import check_episode
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.codecs import images
from wsm_data.errors import DataError, Reason
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_depth
from wsm_data.schema.dataset import DatasetManifest

DRIVE = along_x(frames=13, step_m=0.15)
FRAMES = frames_of(DRIVE)
CLIP = ClipConfig(width=64, height=32)


def scene(offset_m=(0.0, 0.0, 0.0), origin="cloud"):
    xyz = cloud_points([HALL])[0] + np.array(offset_m)
    return build_scene_map(replace(voxels_from_depth([xyz]), origin=origin), (0.0,), DATASET.robot, 2.0)


def require_sound(record, frames, scene_map, dataset=DATASET):
    loose = replace(dataset, checks=replace(dataset.checks, max_unknown_path_share=1.0, min_path_clearance_m=0.0))
    laid = lay_path(record, scene_map, loose, CLIP)
    verdicts, _ = check_episode(record, frames, scene_map, laid, dataset, CLIP)
    require_kept(*verdicts.values())


def refusal(record=None, frames=FRAMES, scene_map=None, dataset: DatasetManifest = DATASET):
    with pytest.raises(DataError) as caught:
        require_sound(record or record_of(DRIVE), frames, scene_map or scene(), dataset)
    return caught.value


def test_a_sound_trajectory_goes_on():
    require_sound(record_of(DRIVE), FRAMES, scene(), DATASET)


def test_the_cloud_of_another_place_is_refused():
    assert refusal(scene_map=scene((0.0, 0.0, 0.3))).reason is Reason.CLOUD_DISAGREES


def test_a_map_that_was_fused_from_depth_is_not_held_against_it():
    require_sound(record_of(DRIVE), FRAMES, scene((30.0, 0.0, 0.0), "depth"), DATASET)


def test_all_reasons_are_told():
    backwards = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ np.diag([-1.0, 1.0, -1.0, 1.0]))
    error = refusal(backwards, scene_map=scene((30.0, 0.0, 0.0)))
    assert error.reason is Reason.POSE_DEPTH_DISAGREE
    assert Reason.CLOUD_DISAGREES in [one["reason"] for one in error.details["also"]]
    assert "; also cloud.disagrees: " in error.message


def test_colour_images_of_something_else_are_refused():
    rng = np.random.default_rng(0)
    noise = tuple(rng.integers(0, 255, (48, 64, 3)).astype(np.uint8) for _ in FRAMES.rgb)
    error = refusal(frames=replace(FRAMES, rgb=noise))
    assert error.reason is Reason.COLOUR_DISAGREES
    assert abs(error.details["rank_correlation"]) < 0.2  # of some hundred points that have nothing in common


def test_poses_that_stand_still_are_refused():
    poses = DRIVE.T_world_camera
    poses[4:] = poses[4]
    error = refusal(record_of(DRIVE, T_world_camera=poses))
    assert Reason.POSE_MOTION_DISAGREE in {error.reason, *(one["reason"] for one in error.details.get("also", ()))}


def test_images_that_were_sampled_are_not_decoded_again_and_give_the_same_videos(monkeypatch):
    decoded = []
    decode = images.decode_depth
    monkeypatch.setattr(images, "decode_depth", lambda *args: decoded.append(1) or decode(*args))
    scene_map, record = scene(), record_of(DRIVE)
    laid = lay_path(record, scene_map, DATASET, CLIP)
    _, videos = check_episode(record, FRAMES, scene_map, laid, DATASET, CLIP)
    assert len(decoded) == len(FRAMES.depth)
    plain = read_videos(record, FRAMES, DATASET, CLIP)
    for one, other in zip(videos.all, plain.all, strict=True):
        np.testing.assert_array_equal(one, other)
