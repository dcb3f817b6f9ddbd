import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from wsm_data.readers.thinning import moving_frames, pieces
from wsm_data.schema.source.motion import Motion


def path(x_m, yaw_deg):
    T = np.tile(np.eye(4), (len(x_m), 1, 1))
    T[:, 0, 3] = x_m
    T[:, :3, :3] = Rotation.from_euler("z", np.array(yaw_deg)[:, None], degrees=True).as_matrix()
    return T


def test_a_frame_is_kept_when_the_camera_moved_far_enough_from_the_last_kept_one():
    T = path([0, 0.03, 0.06, 0.07, 0.125, 0.13], [0] * 6)
    assert moving_frames(T, Motion(min_step_m=0.05)).tolist() == [0, 2, 4]


def test_a_turn_counts_too_and_a_still_camera_gives_one_frame():
    T = path([0] * 5, [0, 3, 6, 7, 12])
    assert moving_frames(T, Motion(min_step_m=0.05, min_turn_deg=5)).tolist() == [0, 2, 4]
    assert moving_frames(T, Motion(min_step_m=0.05)).tolist() == [0]


def test_without_limits_every_frame_is_kept():
    assert moving_frames(path([0, 0, 0], [0, 0, 0]), Motion()).tolist() == [0, 1, 2]


@given(st.integers(1, 500), st.integers(1, 300))
def test_pieces_cover_all_frames_in_order_and_are_alike_in_length(frames, most):
    cut = pieces(frames, most)
    assert [i for one in cut for i in range(one.start, one.stop)] == list(range(frames))
    lengths = [one.stop - one.start for one in cut]
    assert max(lengths) <= most
    assert max(lengths) - min(lengths) <= 1
    assert len(cut) == -(-frames // most)


def test_zero_means_one_piece():
    assert pieces(1000, 0) == [slice(0, 1000)]
    with pytest.raises(IndexError):
        pieces(1000, 0)[1]
