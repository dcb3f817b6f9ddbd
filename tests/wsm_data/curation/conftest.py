"""Score tables and indexes of invented clips, and a tiny release."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest

from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from surveyed_selection import selected, survey_of  # noqa: F401
from tiny_release import build_clip, clips, make_clip, packed_tiny, tiny  # noqa: F401

from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import FREE, OCCUPIED

DIRECTIONS = {"ease_m": Direction.LOWER, "goal_reachable": Direction.NEUTRAL}


@pytest.fixture(scope="session")
def make_scores() -> Callable[..., ScoreTable]:
    """A table of the given columns; `ease_m` is hard at its low end, the others at their high end, absence allowed."""

    def make(**columns: object) -> ScoreTable:
        values = {name: np.asarray(column, np.float64) for name, column in columns.items()}
        count = len(next(iter(values.values())))
        infos = tuple(
            ScorerInfo(
                name=name,
                unit="m" if name.endswith("_m") else "ratio",
                direction=DIRECTIONS.get(name, Direction.HIGHER),
                summary=f"invented {name}",
                absent="not measured",
            )
            for name in values
        )
        keys = pa.array([f"g_d435i/s/{number:06d}" for number in range(count)])
        return ScoreTable(release_digest="d1", scorers=infos, keys=keys, columns=values)

    return make


@pytest.fixture(scope="session")
def make_index() -> Callable[..., pa.Table]:
    """The columns of an index that a selection reads: `scene/camera` of every clip, all of them in training."""

    def make(places: list[str], splits: list[str] | None = None) -> pa.Table:
        scenes, cameras = [one.split("/")[0] for one in places], [one.split("/")[1] for one in places]
        columns = {
            "key": [f"g_d435i/s/{number:06d}" for number in range(len(places))],
            "split": splits or ["train"] * len(places),
            "physical_scene": [f"g/{scene}" for scene in scenes],
            "group": [f"g_{camera}" for camera in cameras],
            "camera": cameras,
        }
        repeated = {name: pa.array(values).dictionary_encode() for name, values in columns.items() if name != "key"}
        return pa.table({"key": columns["key"], **repeated})

    return make


@pytest.fixture
def far_paths() -> SimpleNamespace:
    """Paths that are near no other: `read(rows)` for as many clips as are asked for, and what was asked."""
    asked: list[int] = []

    def read(rows: np.ndarray) -> Outlines:
        asked.extend(rows.tolist())
        starts = np.stack([rows * 100.0, np.zeros(len(rows))], axis=1)
        paths = np.stack([starts, starts + 5.0], axis=1).astype(np.float32)
        return Outlines(xy_m=paths, floor_z_m=np.zeros(len(rows), np.float32))

    return SimpleNamespace(read=read, asked=asked)


@pytest.fixture
def hall_clip() -> Callable[..., Clip]:
    """A stored clip that goes 2 m straight along a hall of 3 m x 1 m; `walled`: through a wall across all of it."""

    def make(number: int = 0, *, walled: bool = False) -> Clip:
        T = ((1.0, 0.0, 0.0, 0.525), (0.0, 1.0, 0.0, 0.525), (0.0, 0.0, 1.0, 0.5), (0.0, 0.0, 0.0, 1.0))
        goal = (2.525, 0.525, 0.5)
        clip = build_clip(f"synth_d435i/home_0001/{number:06d}", T_world_camera0=T, goal_world_m=goal)
        poses = np.zeros((clip.frame_count, 7), np.float32)
        poses[:, 0], poses[:, 3] = np.linspace(0, 2, len(poses)), 1.0
        cells = np.full((21, 61), FREE, np.uint8)
        cells[:, 30:32] = OCCUPIED if walled else FREE
        return replace(clip, poses=poses, occupancy=cells, geodesic_mm=np.zeros(cells.shape, np.uint16))

    return make
