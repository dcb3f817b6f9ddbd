"""What stands in a scene of MiniWorld, as triangles, and where its floor is: what a robot meets, and its map.

World coordinates are z up, MiniWorld's y up: (x, y, z) of MiniWorld is (x, -z, y) here, a rotation.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from wsm_data.schema.surface import CELL_SIZE_M
from wsm_data.sim.outlines import Outlines, mesh_outlines

T_MINIWORLD_WORLD: Float64Array = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])

_HALF_DIAGONAL_M = CELL_SIZE_M / np.sqrt(2)
_RIM_CELLS = 2


def obstacle_outlines(scene: Any, low_m: float, high_m: float) -> Outlines:
    """Walls and boxes between two heights, laid flat; boxes are full, walls have no thickness."""
    walls = [np.array(room.wall_verts, np.float64).reshape(-1, 4, 3) for room in scene.rooms]
    quads = np.concatenate([*walls, *(_upright(box, (low_m + high_m) / 2) for box in _boxes(scene))])
    world = quads @ T_MINIWORLD_WORLD[:3, :3]  # its transpose is its inverse
    return mesh_outlines(world[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3), low_m, high_m)


def occupancy(scene: Any, outlines: Outlines) -> OccupancyGrid:
    """Cells that an obstacle may touch are occupied, others over a floor free, and those beyond unknown."""
    floors = [np.array(room.outline, np.float64) @ T_MINIWORLD_WORLD[:3, :3] for room in scene.rooms]
    corners = np.concatenate(floors)[:, :2] / CELL_SIZE_M
    low = np.floor(corners.min(axis=0)).astype(int) - _RIM_CELLS
    columns, rows = np.ceil(corners.max(axis=0)).astype(int) + _RIM_CELLS - low
    y, x = np.indices((rows, columns))
    centres = (np.stack([x, y], axis=-1).reshape(-1, 2) + low + 0.5) * CELL_SIZE_M
    on_floor = np.any([_inside(floor[:, :2], centres) for floor in floors], axis=0)
    touched = outlines.clearance_m(centres, 2 * CELL_SIZE_M) <= _HALF_DIAGONAL_M
    cells = np.where(touched, OCCUPIED, np.where(on_floor, FREE, UNKNOWN)).astype(np.uint8)
    origin = int(low[0]), int(low[1])
    return OccupancyGrid(cells=cells.reshape(rows, columns), origin_cell=origin, resolution_m=CELL_SIZE_M)


def _boxes(scene: Any) -> Iterator[Any]:
    """The boxes of a scene: everything in it but the agent, who is not drawn."""
    for entity in scene.entities:
        if entity is scene.agent:
            continue
        if not hasattr(entity, "size"):
            raise ValueError(f"only walls, floors and boxes are known, found {type(entity).__name__}")
        yield entity


def _upright(box: Any, height_m: float) -> Float64Array:
    """Sides of a box, and its section at a height where it is that tall; float64 [4 or 5, 4, 3], y up."""
    width, tall, length = box.size
    c, s = np.cos(box.dir), np.sin(box.dir)
    ground = np.array([[-width, -length], [width, -length], [width, length], [-width, length]]) / 2
    x, z = c * ground[:, 0] + s * ground[:, 1], -s * ground[:, 0] + c * ground[:, 1]
    base = np.column_stack([x + box.pos[0], np.full(4, box.pos[1]), z + box.pos[2]])
    top = base + np.array([0, tall, 0])
    sides = [np.stack([base[i], base[i - 1], top[i - 1], top[i]]) for i in range(4)]
    section = base + np.array([0, min(height_m, tall), 0])
    return np.stack([*sides, section])


def _inside(polygon: Float64Array, points: Float64Array) -> BoolArray:
    """Which points [N, 2] lie in a convex polygon [K, 2] or on its rim, whichever way round it goes."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    offset = points[:, None] - polygon
    side = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]
    return np.asarray((side >= 0).all(axis=1) | (side <= 0).all(axis=1))
