import numpy as np
import pytest

from wsm_data.curation.scorers.view_change import FARTHEST_M, NEAREST_M, view_change_rad


def test_turning_on_the_spot_it_is_the_rotation_per_frame(drive, floor):
    turning = drive(floor(8.0, 6.0), np.full((11, 2), 3.0), heading_rad=np.linspace(0, 1.0, 11), goal_xy_m=(5.0, 3.0))
    # headings turn the camera about the vertical: the angle of the rotation is that of the heading, pitch or not
    assert view_change_rad(turning) == pytest.approx(0.1)


def test_driving_at_a_wall_it_is_the_sum_of_steps_over_what_is_left(drive, floor):
    trajectory = drive(floor(8.0, 6.0), [(4.0, 3.0), (7.0, 3.0)], step_m=0.1)
    ahead = 8.0 - np.linspace(4.0, 6.9, 30)
    assert view_change_rad(trajectory) == pytest.approx((0.1 / ahead).mean())


def test_nearer_walls_and_faster_frames_make_it_harder(drive, floor):
    found = [view_change_rad(drive(floor(width_m, 6.0), [(1.0, 3.0), (2.5, 3.0)])) for width_m in (6.0, 4.0, 3.0)]
    assert found == sorted(found)
    steps = [view_change_rad(drive(floor(8.0, 6.0), [(1.0, 3.0), (5.0, 3.0)], step_m=one)) for one in (0.02, 0.05, 0.1)]
    assert steps == sorted(steps)


def test_scene_depth_is_kept_within_what_the_model_sees(drive, floor):
    far = drive(floor(20.0, 6.0), [(1.0, 3.0), (2.0, 3.0)], step_m=0.1)
    assert view_change_rad(far) == pytest.approx(0.1 / FARTHEST_M)
    near = drive(floor(8.0, 6.0), [(7.9, 3.0), (7.96, 3.0)], step_m=0.06)
    assert view_change_rad(near) == pytest.approx(0.06 / NEAREST_M)


def test_a_single_frame_does_not_change(drive, floor):
    assert view_change_rad(drive(floor(8.0, 6.0), [(3.0, 3.0)], goal_xy_m=(5.0, 3.0))) == 0.0
