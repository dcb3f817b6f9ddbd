import hashlib

import numpy as np
import pytest

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.maps.footprint import clearance_m
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.sim.episodes import Episode, make_episodes, read_episodes, write_episodes


@pytest.fixture(scope="module")
def hall():
    """A free place of 20 m x 20 m."""
    cells = np.zeros((400, 400), np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 1
    return OccupancyGrid(cells=cells, origin_cell=(-200, -200), resolution_m=0.05)


def numbers(episodes):
    away = np.array([one.goal_xy_m - one.start_pose[:2] for one in episodes])
    bearing = np.arctan2(away[:, 1], away[:, 0]) - [one.start_pose[2] for one in episodes]
    return np.linalg.norm(away, axis=1), np.degrees(np.abs((bearing + np.pi) % (2 * np.pi) - np.pi))


def test_distances_and_bearings_are_distributed_as_in_the_public_home_set(hall):
    distance, bearing = numbers(make_episodes(hall, 3000, 0.3, seed=0))
    assert distance.min() >= 4.0
    assert distance.max() < 13.7
    assert np.median(distance) == pytest.approx(5.51, abs=0.12)
    assert distance.mean() == pytest.approx(5.94, abs=0.12)
    assert np.median(bearing) == pytest.approx(31, abs=2)
    assert np.quantile(bearing, 0.9) == pytest.approx(101, abs=5)
    assert (bearing > 90).mean() == pytest.approx(0.135, abs=0.02)


def test_starts_and_goals_are_free_in_one_connected_part(rooms):
    for one in make_episodes(rooms.grid, 30, 0.35, seed=1):
        assert clearance_m(rooms.grid, np.stack([one.start_pose[:2], one.goal_xy_m])).min() > 0.3
        assert -np.pi <= one.start_pose[2] <= np.pi


def test_the_same_seed_gives_the_same_episodes(rooms):
    first, again = (make_episodes(rooms.grid, 3, 0.35, seed=5) for _ in range(2))
    assert all((a.start_pose == b.start_pose).all() for a, b in zip(first, again, strict=True))


def test_a_map_that_is_too_small_is_refused():
    small = OccupancyGrid(cells=np.zeros((40, 40), np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    with pytest.raises(ConfigError, match="two free places 4"):
        make_episodes(small, 1, 0.1, seed=0)


def test_a_file_of_100_episodes_has_the_public_bytes(tmp_path, hall):
    write_episodes(tmp_path / "a.npy", make_episodes(hall, 100, 0.3, seed=0))
    data = (tmp_path / "a.npy").read_bytes()
    assert len(data) == 4128
    assert data[:8] == b"\x93NUMPY\x01\x00"
    assert b"'descr': '<f8', 'fortran_order': False, 'shape': (100, 5)" in data


def test_columns_are_start_goal_and_yaw(tmp_path):
    row = (3.30553707, -0.06315913, -1.5226889, -2.12152874, -2.4462998)  # the first row of a public file
    np.save(tmp_path / "a.npy", np.array([row]))
    (one,) = read_episodes(tmp_path / "a.npy")
    assert one.start_pose.tolist() == [row[0], row[1], row[4]]
    assert one.goal_xy_m.tolist() == [row[2], row[3]]
    assert one.straight_m == pytest.approx(np.hypot(row[2] - row[0], row[3] - row[1]))
    write_episodes(tmp_path / "b.npy", (one,))
    same = [hashlib.sha256((tmp_path / name).read_bytes()).digest() for name in ("a.npy", "b.npy")]
    assert same[0] == same[1]


@pytest.mark.parametrize("rows", [np.zeros((3, 4)), np.zeros((3, 5), np.float32), np.full((1, 5), np.nan)])
def test_another_table_is_refused(tmp_path, rows):
    np.save(tmp_path / "a.npy", rows)
    with pytest.raises(IntegrityError, match="finite float64"):
        read_episodes(tmp_path / "a.npy")


def test_what_is_no_npy_file_is_refused_and_what_is_missing_is_a_wrong_request(tmp_path):
    (tmp_path / "a.npy").write_bytes(b"start,goal\n")
    with pytest.raises(IntegrityError, match=r"must be a \.npy file"):
        read_episodes(tmp_path / "a.npy")
    with pytest.raises(ConfigError, match="no episodes"):
        read_episodes(tmp_path / "b.npy")


def test_an_episode_knows_its_straight_distance():
    one = Episode(start_pose=np.array([1.0, 1.0, 0.0]), goal_xy_m=np.array([4.0, 5.0]))
    assert one.straight_m == 5.0
