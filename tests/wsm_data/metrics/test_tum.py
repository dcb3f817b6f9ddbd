import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.tum import StampedTrajectory, read_tum, write_tum


def trajectory(count=5):
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.random(count, random_state=0).as_matrix()
    T[:, :3, 3] = np.random.default_rng(0).normal(size=(count, 3))
    return StampedTrajectory(stamps_s=np.arange(count) / 30, T_world_camera=T)


def test_what_is_written_is_read_back_to_its_decimals(tmp_path):
    write_tum(tmp_path / "a.txt", trajectory())
    again = read_tum(tmp_path / "a.txt")
    np.testing.assert_allclose(again.stamps_s, trajectory().stamps_s, atol=1e-9)
    np.testing.assert_allclose(again.T_world_camera, trajectory().T_world_camera, atol=1e-8)


def test_the_quaternion_stands_last_with_w_at_the_end(tmp_path):
    T = np.eye(4)[None].copy()
    T[0, :3, :3] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    write_tum(tmp_path / "a.txt", StampedTrajectory(stamps_s=np.array([2.5]), T_world_camera=T))
    assert (tmp_path / "a.txt").read_text() == (
        "2.500000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.707106781 0.707106781\n"
    )


def test_comments_blank_lines_and_quaternions_of_any_length_are_read(tmp_path):
    (tmp_path / "a.txt").write_text("# a comment\n\n0 1 2 3 0 0 0 2\n1.5 1 2 3 0 0 0 -1\n")
    again = read_tum(tmp_path / "a.txt")
    assert again.centres_m.tolist() == [[1, 2, 3], [1, 2, 3]]
    assert (again.T_world_camera[:, :3, :3] == np.eye(3)).all()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no line with a pose"),
        ("0 1 2 3 0 0 0\n", "line 1 must be 8 finite numbers"),
        ("0 1 2 3 0 0 0 1\n1 nan 2 3 0 0 0 1\n", "line 2 must be 8 finite numbers"),
        ("0 1 2 x 0 0 0 1\n", "no number"),
        ("0 1 2 3 0 0 0 0\n", "the quaternion in line 1 is zero"),
        ("# c\n1 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n", "the one in line 3"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(tmp_path, text, why):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(DataError, match=why) as refusal:
        read_tum(tmp_path / "a.txt")
    assert refusal.value.reason == Reason.TRAJECTORY_UNREADABLE


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_tum(tmp_path / "none.txt")


def test_stamps_that_do_not_rise_make_no_trajectory():
    with pytest.raises(ValueError, match="must rise"):
        StampedTrajectory(stamps_s=np.zeros(2), T_world_camera=np.tile(np.eye(4), (2, 1, 1)))
