"""Drives through MiniWorld become a source that is read back; skipped where MiniWorld cannot be drawn."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.operations import record_miniworld as recording
from pipelines.operations.record_miniworld import RecordRequest, record_miniworld
from wsm_data.errors import ConfigError
from wsm_data.readers.array_episodes import ARRAYS
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid
from wsm_data.sim.base import CONTROL_STEP_S
from wsm_data.sim.config import SimConfig

SIM = SimConfig(intrinsics=Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60))


class Corridor:
    """A world of 12 m x 2 m that nobody has to draw: black, and everything 1 m away."""

    def __init__(self, index):
        self.scene = f"corridor_{index}"
        cells = np.full((40, 240), OCCUPIED, np.uint8)
        cells[1:-1, 1:-1] = FREE
        self.grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)

    def render(self, T_world_camera):
        del T_world_camera
        return np.zeros((60, 80, 3), np.uint8), np.ones((60, 80), np.float32)

    def clearance_m(self, xy_m):
        to_walls = np.minimum.reduce([xy_m[:, 0], 12 - xy_m[:, 0], xy_m[:, 1], 2 - xy_m[:, 1]])
        return (to_walls - 0.05).clip(0, 0.75)


def test_drives_that_arrive_become_episodes_with_the_poses_of_the_robots_camera(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(recording, "open_world", lambda scene, _: Corridor(scene.index))
    record_miniworld(tmp_path, RecordRequest(scenes=2, episodes=1, seed=3), SIM, quiet=True)
    assert "2 of 2 drives arrived" in capsys.readouterr().out
    dataset = load_dataset("arrays")
    dataset = replace(dataset, motion=replace(dataset.motion, min_step_m=0.0, min_turn_deg=0.0, max_frames=0))
    for container in ARRAYS.find_containers(tmp_path, dataset):
        (record,) = ARRAYS.scan(tmp_path, container, dataset, 10).records
        assert record.camera_height_m == pytest.approx(SIM.camera_height_m)
        steps_m = np.linalg.norm(np.diff(record.T_world_camera[:, :3, 3], axis=0), axis=1)
        assert steps_m.max() <= SIM.max_speed * CONTROL_STEP_S + 1e-9
        assert np.linalg.norm(record.T_world_camera[-1, :2, 3] - record.T_world_camera[0, :2, 3]) > 3


def test_a_source_without_a_single_drive_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "open_world", lambda scene, _: Corridor(scene.index))
    monkeypatch.setattr(recording, "run_episodes", lambda *_: [type("Stuck", (), {"success": False})()])
    with pytest.raises(ConfigError, match="no drive arrived of 1 x 1"):
        record_miniworld(tmp_path, RecordRequest(scenes=1, episodes=1, seed=3), SIM, quiet=True)
