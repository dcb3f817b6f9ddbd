"""Odometry in a generated corner of walls, whose scans are cut out by exact rays."""

import numpy as np
import pytest

from wsm_data.geometry.planar import points_in_base
from wsm_data.planners.depth_odometry import DepthOdometry, outline
from wsm_data.planners.depth_scan import DepthScan

WALLS = [  # segments of a room with a niche, m
    ((-3, -2), (4, -2)), ((4, -2), (4, 1)), ((4, 1), (3, 1)), ((3, 1), (3, 3)), ((3, 3), (-3, 3)), ((-3, 3), (-3, -2)),
]  # fmt: skip


def scan_from(pose, walls=WALLS):
    slopes = np.linspace(0.67, -0.67, 160)
    heading, free = pose[2], np.full(160, np.inf)
    forward, left = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    for a, b in np.array(walls, float):
        for k, slope in enumerate(slopes):
            ray = forward + slope * left
            matrix = np.column_stack([ray, a - b])
            x, share = np.linalg.solve(matrix, a - pose[:2]) if abs(np.linalg.det(matrix)) > 1e-9 else (np.inf, 2)
            if x > 0 and 0 <= share <= 1:
                free[k] = min(free[k], x)
    hit = free < 5.0
    return DepthScan(
        obstacles_xy_m=np.column_stack([free, free * slopes])[hit],
        ray_slopes=slopes,
        free_x_m=np.minimum(free, 5.0),
        hit=hit,
    )


def test_normals_of_a_wall_stand_at_right_angles_to_it():
    points, normals = outline(scan_from(np.array([0.0, -0.5, 0.0])))
    ahead = (np.abs(points[:, 0] - 4.0) < 1e-6) & (np.abs(points[:, 1]) < 1.0)  # away from the corners
    assert ahead.sum() > 20
    np.testing.assert_allclose(np.abs(normals[ahead]), np.tile([1.0, 0.0], (ahead.sum(), 1)), atol=1e-9)


def test_a_drive_with_turns_is_followed_within_two_centimetres():
    odometry, pose, worst = DepthOdometry(), np.array([0.0, -0.5, 0.0]), 0.0
    start = pose.copy()
    for step in range(80):
        found = odometry.add(scan_from(pose))
        true = np.append(pose[:2] - start[:2], pose[2])
        worst = max(worst, float(np.linalg.norm(found[:2] - true[:2])))
        turn = 0.05 * np.sin(step / 8)
        pose = pose + np.array([0.03 * np.cos(pose[2]), 0.03 * np.sin(pose[2]), turn])
    assert np.linalg.norm(pose[:2] - start[:2]) > 1.5
    assert worst < 0.02


def test_turning_before_a_bare_wall_after_a_drive_the_estimate_stays():
    """Scans say nothing along the wall, and the motion until then ran along it; that wheels do not slip holds it."""
    odometry, pose = DepthOdometry(), np.array([-2.0, -0.5, -0.6])
    start = pose.copy()
    for step in range(24):
        odometry.add(scan_from(pose, walls=[((-9, -2), (9, -2))]))
        moved = 0.06 * np.array([np.cos(pose[2]), np.sin(pose[2]), 0.0])
        pose = pose + (moved if step < 12 else np.array([0.0, 0.0, 0.05]))
    true = points_in_base(pose[None, :2], start)[0]
    assert np.linalg.norm(odometry.add(scan_from(pose, walls=[((-9, -2), (9, -2))]))[:2] - true) < 0.03


def test_the_first_scan_is_the_origin_and_a_blind_one_continues_the_motion():
    odometry = DepthOdometry()
    assert (odometry.add(scan_from(np.array([0.0, 0.0, 0.3]))) == 0).all()
    for x in (0.05, 0.1, 0.15, 0.2):
        moved = odometry.add(scan_from(np.array([x * np.cos(0.3), x * np.sin(0.3), 0.3])))
    blind = DepthScan(
        obstacles_xy_m=np.zeros((0, 2)), ray_slopes=np.zeros(4), free_x_m=np.zeros(4), hit=np.zeros(4, np.bool_)
    )
    assert odometry.add(blind)[0] == pytest.approx(moved[0] + 0.05, abs=0.005)
