"""Depth of an analytic room, fused: the points lie where the walls are."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, HALL, METRES_PER_UNIT, PILLAR, Room, along_x, encoded, frames_of, raw_depth, record_of

from wsm_data.clips.depth_fusion import fused_points
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.identity import EpisodeId

DRIVE = along_x()
LONGEST_RAY = float(np.linalg.norm([31.5 / 40, 23.5 / 40, 1.0]))  # of the image's corner, per metre of depth
QUANTISATION_M = METRES_PER_UNIT / 2 * LONGEST_RAY
"""Depth is rounded to half a unit, and moves a point along its ray by that times the length of the ray."""


def fuse(drive=DRIVE, record=None, encoding=DATASET.depth, files=None):
    record = record or record_of(drive)
    files = files or dict(enumerate(frames_of(drive).depth))
    return list(fused_points([record], {record.id.text: tuple(files.items())}, encoding))


def distance_to_surface_m(points, room):
    """From each point to the nearest surface of the room and its boxes, from the inside as from the outside, m."""
    return np.min([np.abs(distance_m(points, *box)) for box in ((room.low, room.high), *room.boxes)], axis=0)


def distance_m(points, low, high):
    """Distance to the surface of a box, negative inside, m."""
    beyond = np.maximum(np.array(low) - points, points - np.array(high))
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


def test_every_pixel_becomes_a_point_on_a_wall_to_the_rounding_of_its_depth():
    frames = fuse()
    assert [points.shape for points in frames] == [(64 * 48, 3)] * len(DRIVE.xy_m)
    assert distance_to_surface_m(np.concatenate(frames), HALL).max() <= QUANTISATION_M


def test_what_the_camera_sees_of_a_pillar_is_there():
    points = np.concatenate(fuse())
    low, high = np.array(PILLAR[0]) - QUANTISATION_M, np.array(PILLAR[1]) + QUANTISATION_M
    on_pillar = ((points >= low) & (points <= high)).all(axis=1)
    assert on_pillar.sum() > 100
    assert distance_to_surface_m(points[on_pillar], Room(low=PILLAR[0], high=PILLAR[1])).max() <= QUANTISATION_M


def test_poses_in_other_camera_axes_put_the_points_elsewhere():
    turned = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0]))
    assert np.median(distance_to_surface_m(np.concatenate(fuse(record=turned)), HALL)) > 0.2


def test_each_frame_is_moved_by_its_own_pose():
    files = frames_of(DRIVE).depth
    alone = fuse(files={3: files[3]})
    np.testing.assert_array_equal(alone[0], fuse()[3])


def test_codes_without_a_measurement_are_no_points():
    raw = raw_depth(DRIVE)[0]
    raw[:24], raw[24:30] = 0, 41234
    (points,) = fuse(files={0: encoded(".png", raw)})
    assert len(points) == 24 * 64
    encoding = DepthEncoding(metres_per_unit=METRES_PER_UNIT, invalid_codes=(0, 41234))
    (points,) = fuse(files={0: encoded(".png", raw)}, encoding=encoding)
    assert len(points) == 18 * 64


def test_depths_outside_the_papers_range_are_left_out_and_its_ends_are_in_it():
    raw = np.full((48, 64), 30000, np.uint16)
    raw[0, :4] = 1999, 2000, 50000, 50001  # the paper's range is 0.2 to 5 m
    (points,) = fuse(files={0: encoded(".png", raw)})
    assert len(points) == 64 * 48 - 2


@pytest.mark.parametrize("damage", [lambda png: png[: len(png) // 2], lambda png: b"", lambda png: b"no png"])
def test_a_frame_that_does_not_decode_adds_nothing_and_the_others_stay(damage):
    files = dict(enumerate(frames_of(DRIVE).depth))
    whole = fuse(files=files)
    files[2] = damage(files[2])
    found = fuse(files=files)
    assert len(found) == len(whole) - 1
    np.testing.assert_array_equal(np.concatenate(found), np.concatenate(whole[:2] + whole[3:]))


def test_a_trajectory_without_samples_adds_nothing_and_samples_of_others_are_not_used():
    other = replace(record_of(DRIVE), id=EpisodeId("box_zed", "hall", "000001"))
    samples = {"box_zed/hall/000009": ((0, frames_of(DRIVE).depth[0]),)}
    assert list(fused_points([other], samples, DATASET.depth)) == []
