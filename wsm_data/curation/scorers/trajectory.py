"""What the geometry scores look at: a camera's way through the world, on the map of its scene."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.maps.crop import crop_around
from wsm_data.maps.footprint import clearance_m
from wsm_data.maps.retreat import necessary_retreat_m
from wsm_data.schema.arrays import Float64Array, require_array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import OccupancyGrid

CLEARANCE_CAP_M = 2.0
"""Clearance is not told apart beyond this: maps are cropped so far from the path (`ClipConfig.map_margin_m`)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """An expert's way to its goal, without the still frames that pad a clip.

    Attributes:
        T_world_camera: camera poses, world z up, m; float64 [N, 4, 4], N >= 1.
        intrinsics: the camera.
        goal_xy_m: the goal over the floor, world, m; float64 [2].
        goal_radius_m: radius r_g of the goal region, m.
        start_distance_m: geodesic distance D of the first position to the goal region, m; infinite without a way.
        map: what is known of the floor; path and goal lie inside it, at least a cell from its rim.
        robot_radius_m: radius of the footprint, m.
    """

    T_world_camera: Float64Array
    intrinsics: Intrinsics
    goal_xy_m: Float64Array
    goal_radius_m: float
    start_distance_m: float
    map: OccupancyGrid
    robot_radius_m: float

    def __post_init__(self) -> None:
        require_array("T_world_camera", self.T_world_camera, np.float64, (None, 4, 4))
        require_array("goal_xy_m", self.goal_xy_m, np.float64, (2,))
        cells = np.floor(np.concatenate([self.path_cells, self.goal_cells[None]]))
        if (cells < 1).any() or (cells >= np.array(self.map.cells.shape[::-1]) - 1).any():
            raise ValueError("path and goal must lie inside the map, at least a cell from its rim")

    @property
    def path_xy_m(self) -> Float64Array:
        """Positions over the floor, world, m; float64 [N, 2]."""
        return self.T_world_camera[:, :2, 3]

    @cached_property
    def path_cells(self) -> Float64Array:
        """Positions as (x, y) in cells of the map, whole numbers at the borders of cells; float64 [N, 2]."""
        return self.map.fractional_cells(self.path_xy_m) + 0.5

    @property
    def goal_cells(self) -> Float64Array:
        """The goal in the same coordinates; float64 [2]."""
        return self.map.fractional_cells(self.goal_xy_m) + 0.5

    @cached_property
    def steps_m(self) -> Float64Array:
        """Way between one frame and the next, m; float64 [N - 1]."""
        return np.hypot(*np.diff(self.path_xy_m, axis=0).T)

    @cached_property
    def weights(self) -> Float64Array:
        """Share of the way that each frame stands for: half of the step before it and half of that after it.

        A share of the path therefore does not depend on the frame rate, nor on standing still. Without any way every
        frame counts the same. float64 [N], sum 1.
        """
        total = float(self.steps_m.sum())
        if total == 0:
            return np.full(len(self.T_world_camera), 1 / len(self.T_world_camera))
        halves = self.steps_m / (2 * total)
        return np.concatenate([halves, [0.0]]) + np.concatenate([[0.0], halves])

    @cached_property
    def heading_rad(self) -> Float64Array:
        """Direction of the optical axis over the floor, from the world's x axis towards y, unwrapped; float64 [N]."""
        axis = self.T_world_camera[:, :2, 2]
        return np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))

    @cached_property
    def clearance_m(self) -> Float64Array:
        """Distance of each position to the nearest occupied square, m, at most 2; float64 [N]."""
        return np.minimum(clearance_m(self.map, self.path_xy_m), CLEARANCE_CAP_M)

    @cached_property
    def retreat_m(self) -> Float64Array:
        """How far one must move away from the goal to reach it from each position, m; float64 [N]."""
        return necessary_retreat_m(self.map, self.path_xy_m, self.goal_xy_m, self.robot_radius_m, self.goal_radius_m)

    @cached_property
    def goal_distance_m(self) -> Float64Array:
        """Straight-line distance of each position to the goal, m; float64 [N]."""
        return np.hypot(*(self.path_xy_m - self.goal_xy_m).T)


def trajectory_of(clip: Clip) -> Trajectory:
    """The trajectory of a stored clip; where its map does not reach, nothing is known."""
    meta = clip.meta
    T_camera0_camera = transforms_from_vectors(clip.poses[: meta.recorded_frames].astype(np.float64))
    T_world_camera = meta.T_world_camera0_matrix @ T_camera0_camera
    goal_xy_m = np.array(meta.goal_world_m[:2], np.float64)
    grid = OccupancyGrid(cells=clip.occupancy, origin_cell=meta.map_origin_cell, resolution_m=meta.map_resolution_m)
    return Trajectory(
        T_world_camera=T_world_camera,
        intrinsics=meta.intrinsics,
        goal_xy_m=goal_xy_m,
        goal_radius_m=meta.goal_radius_m,
        start_distance_m=float(clip.expert_distance[0]),
        map=map_with(grid, np.concatenate([T_world_camera[:, :2, 3], goal_xy_m[None]])),
        robot_radius_m=meta.robot_radius_m,
    )


def map_with(grid: OccupancyGrid, points_xy_m: Float64Array) -> OccupancyGrid:
    """A map grown by unknown cells until points [N, 2] (world, m), and all that it had, lie a cell from its rim."""
    rows, columns = grid.cells.shape
    corners = grid.cell_centres_xy_m(np.array([[0.0, 0.0], [columns - 1.0, rows - 1.0]]))
    return crop_around(grid, np.concatenate([corners, points_xy_m]), grid.resolution_m)
