from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.geometry.transform import rigidity_error
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.drive.expert import Episode, plan_episode, smooth_way
from wsm_data.synth.drive.occupancy import Clearance, clearance

REAL = SynthConfig()


@pytest.fixture(scope="module")
def episodes(home, columns) -> list[Episode]:
    return [plan_episode(home, columns, np.random.default_rng(seed), REAL) for seed in range(8)]


def test_lengths_and_steps_are_those_of_the_real_set(episodes):
    for episode in episodes:
        steps = np.linalg.norm(np.diff(episode.T_world_opengl[:, :3, 3].astype(float), axis=0), axis=1)
        assert REAL.min_frames <= len(episode.T_world_opengl) <= REAL.max_frames
        assert REAL.min_step_m - 1e-3 < steps.mean() < REAL.max_step_m + 1e-3
        assert steps.std() < 0.01 * steps.mean()  # steady; chords of a curve are a little shorter


def test_paths_keep_the_clearance_measured_on_the_real_set(episodes, columns):
    medians = []
    for episode in episodes:
        room = clearance(columns, episode.camera_height_m, REAL).at(episode.T_world_opengl[:, :2, 3].astype(float))
        assert room.min() > 0.29  # robot 0.25 m and margin 0.05 m; float32 and sampling may lose a little
        medians.append(float(np.median(room)))
    assert 0.4 < np.median(medians) < 0.75  # measured: scene medians of 0.46 to 0.68 m


def test_mounts_span_heights_and_pitches_and_stay_fixed_within_an_episode(episodes):
    heights = [episode.camera_height_m for episode in episodes]
    pitches = [np.degrees(episode.camera_pitch_rad) for episode in episodes]
    assert 0.25 <= min(heights) < 0.6
    assert 1.1 < max(heights) <= 1.5
    assert 0 <= min(pitches) < 12
    assert 18 < max(pitches) <= 30
    for episode in episodes:
        assert (episode.T_world_opengl[:, 2, 3] == np.float32(episode.camera_height_m)).all()
        up = episode.T_world_opengl[:, 2, :3]
        assert np.abs(up - episode.T_base_camera[2, :3]).max() < 1e-6


def test_the_camera_looks_along_the_path_and_down_by_the_pitch(episodes):
    for episode in episodes:
        T = episode.T_world_camera
        assert rigidity_error(T).max() < 1e-6
        forward = T[:, :3, 2]
        assert -forward[:, 2] == pytest.approx(np.full(len(T), np.sin(episode.camera_pitch_rad)), abs=1e-6)
        tangent = np.diff(T[:, :2, 3], axis=0)
        cosine = (forward[:-1, :2] * tangent).sum(axis=1)
        cosine /= np.linalg.norm(forward[:-1, :2], axis=1) * np.linalg.norm(tangent, axis=1)
        assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 25
        assert np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))) < 5


def test_the_mount_looks_along_y_at_yaw_zero_and_stands_at_camera_height(episodes):
    # as InternData-N1's public loader reads it: rotation about x by 90 deg - pitch, translation z = camera height
    episode = episodes[0]
    mount = episode.T_base_camera.astype(float)
    angle = np.pi / 2 - episode.camera_pitch_rad
    c, s = np.cos(angle), np.sin(angle)
    expected = [[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, episode.camera_height_m], [0, 0, 0, 1]]
    assert np.abs(mount - expected).max() < 1e-6
    forward = -mount[:3, 2]
    assert forward[:2] == pytest.approx([0, np.cos(episode.camera_pitch_rad)], abs=1e-6)


def test_most_ways_lead_into_another_room(home, episodes):
    from wsm_data.synth.home.home import room_at

    ends = [
        (
            room_at(home.floor_plan, tuple(e.T_world_opengl[0, :2, 3])),
            room_at(home.floor_plan, tuple(e.T_world_opengl[-1, :2, 3])),
        )
        for e in episodes
    ]
    assert sum(a is not b for a, b in ends) >= 5


def test_a_staircase_of_cells_becomes_a_smooth_curve():
    room = Clearance(distance_m=np.full((80, 80), 2.0), origin_m=(0.0, 0.0))
    stairs = np.cumsum(np.tile([[0.05, 0.0], [0.0, 0.05]], (25, 1)), axis=0) + 0.5
    curve = smooth_way(stairs, room, 0.3)
    heading = np.degrees(np.arctan2(*np.diff(curve, axis=0).T[::-1]))
    middle = heading[len(heading) // 4 : -len(heading) // 4]
    assert np.abs(middle - 45).max() < 5  # the cells themselves turn by 90 degrees every 5 cm
    assert curve[[0, -1]] == pytest.approx(stairs[[0, -1]], abs=1e-6)


def test_a_curve_that_would_touch_is_not_used():
    room = Clearance(distance_m=np.full((80, 80), 0.2), origin_m=(0.0, 0.0))
    assert smooth_way(np.linspace([0.5, 0.5], [3.0, 3.0], 60), room, 0.3) is None


def test_ways_that_do_not_fit_into_the_home_are_refused_with_what_was_asked_for(home, columns):
    endless = replace(REAL, min_frames=900, max_frames=999, min_step_m=0.5, max_step_m=0.6)
    with pytest.raises(ConfigError, match="900 to 999 frames"):
        plan_episode(home, columns, np.random.default_rng(0), endless)
