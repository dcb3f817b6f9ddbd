import numpy as np
import pytest

from wsm_data.checks.images.video_warp import pair_motions, warp_errors
from wsm_data.codecs.depth import normalise_depth
from wsm_data.geometry.transform import invert
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange

K = Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60)
RANGE = DepthRange()


def wall(distance_m):
    return normalise_depth(np.full((60, 80), distance_m), RANGE)


def ahead(by_m):
    """The camera moved ahead by so much from frame a to frame b."""
    T = np.eye(4)
    T[2, 3] = -by_m
    return T


def test_a_wall_comes_nearer_by_as_much_as_the_camera_drives():
    """From 3 m to 2.5 m: 0.5 m is right; standing still errs by log(3 / 2.5), half of the way by log(2.75 / 2.5)."""
    video = np.stack([wall(3.0), wall(2.5)])
    errors = warp_errors(video, 0, 1, np.stack([ahead(0.5), ahead(0.0), ahead(0.25)]), K, RANGE, 100)
    assert len(errors) > 50
    np.testing.assert_allclose(errors, np.tile([0, np.log(3 / 2.5), np.log(2.75 / 2.5)], (len(errors), 1)), atol=1e-5)


def test_only_points_are_told_that_all_motions_show():
    video = np.stack([wall(3.0), wall(3.0)])
    turned = np.eye(4)
    turned[:3, :3] = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]  # a quarter turn: nothing of a is seen
    assert len(warp_errors(video, 0, 1, np.stack([np.eye(4), turned]), K, RANGE, 100)) == 0


@pytest.mark.parametrize("value", [1.0, -1.0])
def test_the_ends_of_the_range_and_what_is_not_measured_tell_nothing(value):
    video = np.stack([wall(3.0), wall(3.0)])
    for frame in (0, 1):
        emptied = video.copy()
        emptied[frame] = value
        assert len(warp_errors(emptied, 0, 1, np.eye(4)[None], K, RANGE, 100)) == 0


def test_edges_do_not_count():
    video = np.stack([wall(3.0), wall(3.0)])
    video[1, :, ::2] = wall(2.0)[0, 0]
    assert len(warp_errors(video, 0, 1, np.eye(4)[None], K, RANGE, 100)) == 0


def test_motions_are_those_between_the_poses_of_other_frames(make_record):
    T = make_record(frames=12).T_world_camera
    motions = pair_motions(T, np.array([2, 3]), np.array([4, 8]), [(0, 0), (2, 2), (0, -1)])
    assert motions.shape == (2, 3, 4, 4)
    for motion, (a, b) in zip(motions[1], [(3, 8), (5, 10), (3, 7)], strict=True):
        np.testing.assert_allclose(motion, invert(T[b]) @ T[a], atol=1e-12)
