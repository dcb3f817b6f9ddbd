"""What a robot of a given height may drive over, cut from a scene map to the centimetre."""

import math

import numpy as np
from numba import njit

from wsm_data.maps.scene_map import SceneMap
from wsm_data.schema.arrays import BoolArray, Int16Array, Uint8Array
from wsm_data.schema.dataset import Robot
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from wsm_data.schema.surface import CELL_SIZE_M, LAYER_HEIGHT_M

_ROUNDING = 1e-6
"""Heights this near to the border of a layer count as on it, layers: 0.15 / 0.01 is not 15 in binary."""


def occupancy_for(scene_map: SceneMap, floor_z_m: float, robot_height_m: float, robot: Robot) -> OccupancyGrid:
    """Occupancy of one floor for a robot of one height.

    With heights above the floor, of boxes one centimetre high:
      - OCCUPIED where a surface lies between the ground clearance and the robot's height, or a box that the source
        marks as an obstacle between the floor and the robot's height;
      - FREE where a surface lies within the ground clearance of the floor, above or below, and nothing occupies it;
      - UNKNOWN otherwise.

    Fused depth has stray boxes at depth edges. So in a map of that origin a box counts only if the cell or one of its
    eight neighbours has a second box in the robot's band: a surface that a robot can run into is more than one
    box of 5 cm x 5 cm x 1 cm. A cell with nothing but a stray box is what its floor says it is. Clouds are taken
    at their word. Either way a taller robot never has fewer occupied cells.

    Args:
        scene_map: the scene.
        floor_z_m: the floor of the episode, m; a level of the map must have been built for it.
        robot_height_m: height of the robot, that of its camera, m.
        robot: ground clearance.

    Raises:
        ValueError: the map was built without this floor.
    """
    level = scene_map.level_at(floor_z_m)
    floor_layer = math.floor(floor_z_m / LAYER_HEIGHT_M + 0.5)
    clearance = math.ceil(robot.ground_clearance_m / LAYER_HEIGHT_M - _ROUNDING)
    height = math.ceil(robot_height_m / LAYER_HEIGHT_M - _ROUNDING)
    counts, ground = _count_boxes(level.first, level.layers, level.obstacle, floor_layer, clearance, height)
    band = counts.reshape(level.shape)
    occupied = band > 0
    if scene_map.origin == "depth":
        occupied &= _sum_of_neighbourhood(band) > 1
    cells = np.where(occupied, OCCUPIED, np.where(ground.reshape(level.shape), FREE, UNKNOWN)).astype(np.uint8)
    return OccupancyGrid(cells=cells, origin_cell=level.origin_cell, resolution_m=CELL_SIZE_M)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _count_boxes(
    first: np.ndarray, layers: Int16Array, obstacle: BoolArray, floor_layer: int, clearance: int, height: int
) -> tuple[Uint8Array, BoolArray]:
    """For each cell the boxes in the robot's way (2 stands for more), and whether the ground is seen."""
    counts = np.zeros(len(first) - 1, np.uint8)
    ground = np.zeros(len(first) - 1, np.bool_)
    for cell in range(len(first) - 1):
        for box in range(first[cell], first[cell + 1]):
            above = layers[box] - floor_layer
            if (0 if obstacle[box] else clearance) <= above < height:
                counts[cell] = min(counts[cell] + 1, 2)
            if -clearance <= above < clearance:
                ground[cell] = True
    return counts, ground


def _sum_of_neighbourhood(counts: Uint8Array) -> Uint8Array:
    """Sum over each cell and its eight neighbours; uint8 [Y, X], 18 at most."""
    padded = np.pad(counts, 1)
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray(rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:], np.uint8)
