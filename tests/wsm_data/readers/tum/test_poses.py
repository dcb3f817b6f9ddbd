import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.tum import StampedTrajectory
from wsm_data.readers.tum.poses import poses_at, read_poses
from wsm_data.schema.source.sequence_files import SequenceFiles


def trajectory(count=6, seed=0):
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix()
    T[:, :3, 3] = rng.uniform(-2, 2, (count, 3))
    return StampedTrajectory(stamps_s=np.cumsum(rng.uniform(0.01, 0.02, count)), T_world_camera=T)


def test_poses_between_two_are_those_of_scipys_slerp_and_of_the_line():
    known = trajectory()
    wanted = np.linspace(known.stamps_s[0], known.stamps_s[-1], 41)
    T, found = poses_at(known, wanted, 1.0)
    slerp = Slerp(known.stamps_s, Rotation.from_matrix(known.T_world_camera[:, :3, :3]))
    assert found.all()
    assert np.allclose(T[:, :3, :3], slerp(wanted).as_matrix(), atol=1e-9)
    line = [np.interp(wanted, known.stamps_s, known.T_world_camera[:, axis, 3]) for axis in range(3)]
    assert np.allclose(T[:, :3, 3], np.stack(line, axis=1), atol=1e-12)


def test_no_pose_is_given_outside_of_the_trajectory_or_in_a_gap_but_at_the_very_time_of_one():
    T = np.tile(np.eye(4), (4, 1, 1))
    known = StampedTrajectory(stamps_s=np.array([0.0, 0.01, 1.0, 1.01]), T_world_camera=T)
    times = np.array([-0.001, 0.0, 0.005, 0.01, 0.5, 1.0, 1.01, 1.02])
    assert poses_at(known, times, 0.1)[1].tolist() == [False, True, True, True, False, True, True, False]


def test_a_quaternion_file_a_matrix_file_and_matrix_files_hold_the_same_poses(tmp_path):
    T = trajectory(3).T_world_camera
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    rows = [[i, *T[i, :3, 3], *quaternions[i]] for i in range(3)]
    (tmp_path / "q.txt").write_text(
        "# stamp x y z qx qy qz qw\n" + "\n".join(" ".join(map(repr, map(float, r))) for r in rows)
    )
    (tmp_path / "m.txt").write_text("\n".join(" ".join(map(repr, one.ravel().tolist())) for one in T))
    for i, one in enumerate(T):
        np.savetxt(tmp_path / f"{i}.pose", one, fmt="%.17g")
    for name in ("q.txt", "m.txt", "*.pose"):
        read = read_poses(tmp_path, SequenceFiles(poses=name), "opencv", "s")
        assert read.stamps_s.tolist() == [0, 1, 2]
        assert np.allclose(read.T_world_camera, T, atol=1e-12)


def test_every_world_has_z_up_after_reading(tmp_path):
    """A camera 2 m up that looks down a little ahead: how its up and its forward axis are stored differs by world."""
    up, forward = np.array([0, 0, 1.0]), np.array([0, np.cos(0.3), -np.sin(0.3)])
    stored = {  # our (x, y, z) in the axes of each world
        "z_up": np.eye(3),
        "y_up": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
        "y_down": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    }
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    T = np.eye(4)
    T[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    T[:3, 3] = 2 * up
    for world, axes in stored.items():
        one = np.eye(4)
        one[:3] = axes @ T[:3]
        (tmp_path / "traj.txt").write_text(" ".join(map(repr, one.ravel().tolist())))
        read = read_poses(tmp_path, SequenceFiles(poses="traj.txt", world=world), "opencv", "s")
        assert np.allclose(read.T_world_camera[0], T, atol=1e-12), world


def test_a_left_handed_world_is_mirrored_into_a_right_handed_one(tmp_path):
    """x right, y up, z ahead: a level camera at (1, 2, 3) that looks along z stands at (1, 3, 2) and looks along y."""
    (tmp_path / "traj.txt").write_text("1 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1")
    files = SequenceFiles(poses="traj.txt", world="y_up_left_handed")
    T = read_poses(tmp_path, files, "opencv", "s").T_world_camera[0]
    assert T[:3, 3].tolist() == [1, 3, 2]
    assert T[:3, 2].tolist() == [0, 1, 0]
    assert T[:3, 1].tolist() == [0, 0, -1]
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)


def test_a_tracked_body_carries_its_camera(tmp_path):
    (tmp_path / "traj.txt").write_text("0 -1 0 5  1 0 0 0  0 0 1 0  0 0 0 1")  # a quarter turn about z, at (5, 0, 0)
    files = SequenceFiles(poses="traj.txt", T_tracked_camera=(1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1))
    assert read_poses(tmp_path, files, "opencv", "s").T_world_camera[0, :3, 3].tolist() == [5, 0.5, 0]


def test_lost_tracking_is_no_pose_and_a_scaled_matrix_is_refused(tmp_path):
    lost = " ".join(["-inf"] * 16)
    eye = " ".join(map(str, np.eye(4).ravel().tolist()))
    (tmp_path / "traj.txt").write_text(f"{lost}\n{eye}\n")
    assert read_poses(tmp_path, SequenceFiles(poses="traj.txt"), "opencv", "s").stamps_s.tolist() == [1]
    (tmp_path / "traj.txt").write_text(" ".join(map(str, (1.1 * np.eye(4)).ravel().tolist())))
    with pytest.raises(DataError, match="does it have a scale") as caught:
        read_poses(tmp_path, SequenceFiles(poses="traj.txt"), "opencv", "s")
    assert caught.value.reason is Reason.POSE_NOT_RIGID


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (" ".join(["-inf"] * 16), Reason.SEQUENCE_UNREADABLE),
        (" ".join(["1"] * 15 + ["x"]), Reason.SEQUENCE_UNREADABLE),
        (" ".join(["1"] * 16) + "\n1 2 3", Reason.SEQUENCE_UNREADABLE),
        ("1 2 3", Reason.TRAJECTORY_UNREADABLE),
        ("# nothing", Reason.TRAJECTORY_UNREADABLE),
    ],
)
def test_what_is_no_trajectory_is_refused(tmp_path, text, reason):
    (tmp_path / "traj.txt").write_text(text)
    with pytest.raises(DataError) as caught:
        read_poses(tmp_path, SequenceFiles(poses="traj.txt"), "opencv", "s")
    assert caught.value.reason is reason
