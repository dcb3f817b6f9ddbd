"""The path of a trajectory on the floor of its scene: what its robot can drive over, and whether it drove there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsm_data.checks.expert_path import check_expert_path
from wsm_data.checks.path_shown import check_path_shown
from wsm_data.clips.config import ClipConfig
from wsm_data.errors import DataError, Reason
from wsm_data.maps.crop import crop_around, free_swept_cells
from wsm_data.maps.footprint import clearance_m
from wsm_data.maps.holes import fill_holes
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import MAX_MAP_CELLS, SceneMap
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.schema.verdict import Verdict

LONGEST_STEP_M = 1.5
"""A longer step is a leap of the poses, and says nothing about what lies between, m."""


@dataclass(frozen=True, kw_only=True)
class PathOnFloor:
    """A path on the map of its floor.

    Attributes:
        floor: the map for this robot, reaching as far as the path, with its holes filled and what was swept freed.
        freed_cells: unknown cells that became free so.
        verdicts: by the name of the check: whether a robot can have driven there.
    """

    floor: OccupancyGrid
    freed_cells: int
    verdicts: Mapping[str, Verdict]


def lay_path(record: EpisodeRecord, scene_map: SceneMap, dataset: DatasetManifest, config: ClipConfig) -> PathOnFloor:
    """Cut the map for this robot, fill its holes, and free what the robot swept.

    Raises:
        DataError: `map.too_large`: the path lies so far from the map that they cannot belong together.
    """
    path_xy_m, where = record.path_xy_m, record.id.text
    verdicts = {}
    floor = occupancy_for(scene_map, record.floor_z_m, record.camera_height_m, dataset.robot)
    floor = _around_path(floor, with_goal_xy_m(record), config.map_margin_m, where)
    if scene_map.origin == "cloud":
        verdicts["path_shown"] = check_path_shown(floor, path_xy_m, where, dataset.checks.max_unknown_path_share)
    floor, filled = fill_holes(floor, config.fill_holes_cells)
    floor, freed = free_swept_cells(floor, path_xy_m, dataset.robot.radius_m)
    near_m = _clearance_on_the_way_m(floor, path_xy_m)
    verdicts["expert_path"] = check_expert_path(near_m, where, dataset.checks.min_path_clearance_m)
    return PathOnFloor(floor=floor, freed_cells=filled + freed, verdicts=verdicts)


def with_goal_xy_m(record: EpisodeRecord) -> Float64Array:
    """Camera positions over the floor, and the goal, in the world, m; float64 [T + 1, 2]."""
    return np.concatenate([record.path_xy_m, record.goal_m[None, :2]])


def _clearance_on_the_way_m(floor: OccupancyGrid, path_xy_m: Float64Array) -> Float64Array:
    """Least clearance between every position and the next, on the straight way, m; float64 [T].

    A cloud shows the outside of things: who looks at positions alone finds nothing wrong inside of a wide wall.
    """
    ways_m = np.diff(path_xy_m, axis=0)
    lengths_m = np.linalg.norm(ways_m, axis=1)
    pieces = np.where(lengths_m <= LONGEST_STEP_M, np.ceil(lengths_m / floor.resolution_m), 1)
    counts = np.maximum(1, pieces).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)])
    shares = (np.arange(first[-1]) - np.repeat(first[:-1], counts)) / np.repeat(counts, counts)
    between = np.repeat(path_xy_m[:-1], counts, axis=0) + shares[:, None] * np.repeat(ways_m, counts, axis=0)
    near_m = clearance_m(floor, np.concatenate([between, path_xy_m[-1:]]))
    return np.minimum.reduceat(near_m, first)


def _around_path(floor: OccupancyGrid, path_xy_m: Float64Array, margin_m: float, where: str) -> OccupancyGrid:
    """The whole floor, and where it does not reach as far as the path and its margin, unknown cells.

    Raises:
        DataError: `map.too_large`: the path lies so far from the map that they cannot belong together.
    """
    points_xy_m = np.concatenate([_corners_xy_m(floor), path_xy_m]) if floor.cells.size else path_xy_m
    columns, rows = (np.ptp(points_xy_m, axis=0) + 2 * margin_m) / floor.resolution_m
    if columns * rows > MAX_MAP_CELLS:
        raise DataError(
            Reason.MAP_TOO_LARGE,
            f"{where}: map and path must fit into {MAX_MAP_CELLS} cells, found {columns:.0f} x {rows:.0f} "
            f"({columns * floor.resolution_m:.0f} m x {rows * floor.resolution_m:.0f} m); are the poses in metres, and "
            "of this scene?",
            {"columns": columns, "rows": rows, "path_low_m": path_xy_m.min(axis=0)},
        )
    return crop_around(floor, points_xy_m, margin_m)


def _corners_xy_m(grid: OccupancyGrid) -> Float64Array:
    rows, columns = grid.cells.shape
    return grid.cell_centres_xy_m(np.array([[0, 0], [columns - 1, rows - 1]], np.float64))
