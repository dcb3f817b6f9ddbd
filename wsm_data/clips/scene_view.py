"""A trajectory on the map of its scene: what its robot can drive over, and how far it is to the goal."""

from dataclasses import dataclass

import numpy as np

from wsm_data.checks.expert_path import check_expert_path
from wsm_data.checks.gate import require_kept
from wsm_data.checks.goal_reached import check_goal_reached
from wsm_data.checks.path_shown import check_path_shown
from wsm_data.checks.reachability import check_goal_reachable
from wsm_data.clips.config import ClipConfig
from wsm_data.errors import DataError, Reason
from wsm_data.maps.crop import crop_around, free_swept_cells
from wsm_data.maps.footprint import clearance_m
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.holes import fill_holes
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.progress import sample_distance
from wsm_data.maps.scene_map import MAX_MAP_CELLS, SceneMap
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.occupancy import OccupancyGrid


@dataclass(frozen=True, kw_only=True)
class SceneView:
    """A trajectory on the map of its scene.

    Attributes:
        occupancy: crop of the map around path and goal.
        geodesic_m: geodesic distance to the goal region on the crop, m; float32 [Y, X].
        distance_m: geodesic distance of every camera position, m; float64 [T].
        freed_cells: unknown cells that became free: those the expert's footprint swept, and the holes filled before.
    """

    occupancy: OccupancyGrid
    geodesic_m: Float32Array
    distance_m: Float64Array
    freed_cells: int


def view_scene(record: EpisodeRecord, scene_map: SceneMap, dataset: DatasetManifest, config: ClipConfig) -> SceneView:
    """Cut the map for this robot, fill its holes, free what the robot swept, and measure distances to the goal.

    Distances are measured on the whole floor and cropped afterwards: a detour may lead through rooms that the crop
    leaves out.

    Raises:
        DataError: the path leads through an obstacle, over floor that the cloud never showed or far away from the map,
            the goal cannot be reached, or the expert ends elsewhere than at the stated one.
    """
    path_xy_m, radius_m = record.path_xy_m, dataset.robot.radius_m
    goal_xy_m = record.goal_m[:2]
    around_xy_m = np.concatenate([path_xy_m, goal_xy_m[None]])
    floor = occupancy_for(scene_map, record.floor_z_m, record.camera_height_m, dataset.robot)
    floor = _around_path(floor, around_xy_m, config.map_margin_m, record.id.text)
    if scene_map.origin == "cloud":
        require_kept(check_path_shown(floor, path_xy_m, record.id.text, dataset.checks.max_unknown_path_share))
    floor, filled = fill_holes(floor, config.fill_holes_cells)
    floor, freed = free_swept_cells(floor, path_xy_m, radius_m)
    require_kept(check_expert_path(clearance_m(floor, path_xy_m), record.id.text, dataset.checks.min_path_clearance_m))
    geodesic_m = geodesic_distance(floor, goal_xy_m, radius_m, config.goal_radius_m)
    distance_m = sample_distance(geodesic_m, floor, path_xy_m)
    require_kept(check_goal_reachable(distance_m, record.id.text))
    require_kept(check_goal_reached(float(distance_m[-1]), config.goal_radius_m, record.id.text))
    crop = crop_around(floor, around_xy_m, config.map_margin_m)
    column, row = (inner - outer for inner, outer in zip(crop.origin_cell, floor.origin_cell, strict=True))
    height, width = crop.cells.shape
    return SceneView(
        occupancy=crop,
        geodesic_m=geodesic_m[row : row + height, column : column + width],
        distance_m=distance_m,
        freed_cells=filled + freed,
    )


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
