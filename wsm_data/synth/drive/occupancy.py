"""Where a robot of a given height fits, straight from a home's surfaces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.home import Home
from wsm_data.synth.home.sampling import sample_surface

CELL_M = 0.05
"""Side of a planning cell, m, as wide as a cell of InternData-N1's planning maps."""

_SPACING_M = 0.02
_TALLEST_M = 2.0


@dataclass(frozen=True, kw_only=True)
class SceneColumns:
    """All surfaces of a home as heights over map cells.

    Attributes:
        cell: row-major index of the cell of each surface point; int64 [N].
        z_m: height of each surface point, m; float64 [N].
        floor: cells with floor; bool [Y, X].
        origin_m: lower corner of cell (0, 0), a whole number of cells from the world's origin, m.
    """

    cell: NDArray[np.int64]
    z_m: Float64Array
    floor: BoolArray
    origin_m: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Clearance:
    """Distance to the nearest obstacle for one height of robot.

    Attributes:
        distance_m: from each cell centre to the nearest obstacle's cell, 0 in it; float64 [Y, X].
        origin_m: lower corner of cell (0, 0), m.
    """

    distance_m: Float64Array
    origin_m: tuple[float, float]

    def at(self, xy_m: Float64Array) -> Float64Array:
        """Clearance at points [..., 2] of the world (m), bilinear between cell centres; float64 [...]."""
        xy = np.asarray(xy_m, np.float64)
        column, row = ((xy.reshape(-1, 2) - np.array(self.origin_m)) / CELL_M - 0.5).T
        distance = ndimage.map_coordinates(self.distance_m, [row, column], order=1, mode="nearest")
        return np.asarray(distance).reshape(xy.shape[:-1])

    def centres(self, cells: NDArray[np.int64]) -> Float64Array:
        """World positions of the centres of row-major cells [...]; float64 [..., 2]."""
        columns = self.distance_m.shape[1]
        return (np.stack([cells % columns, cells // columns], axis=-1) + 0.5) * CELL_M + np.array(self.origin_m)


def scene_columns(home: Home) -> SceneColumns:
    """Sort the surfaces of a home into cells; done once, then asked for every height of robot."""
    points, patch = sample_surface(home.surface, _SPACING_M)
    within = points[:, 2] < _TALLEST_M
    points, patch = points[within], patch[within]
    first = np.floor(points[:, :2].min(axis=0) / CELL_M).astype(np.int64) - 1
    last = np.floor(points[:, :2].max(axis=0) / CELL_M).astype(np.int64) + 1
    columns, rows = (last - first + 1).tolist()
    cell_xy = np.floor(points[:, :2] / CELL_M).astype(np.int64) - first
    cell = cell_xy[:, 1] * columns + cell_xy[:, 0]
    floor = np.zeros(rows * columns, np.bool_)
    floor[cell[home.floor_patch[patch]]] = True
    origin = (float(first[0]) * CELL_M, float(first[1]) * CELL_M)
    return SceneColumns(cell=cell, z_m=points[:, 2], floor=floor.reshape(rows, columns), origin_m=origin)


def clearance(columns: SceneColumns, robot_height_m: float, config: SynthConfig) -> Clearance:
    """How much room a robot of this height has; what is lower than its ground clearance it drives over."""
    low, high = config.ground_clearance_m, robot_height_m + config.head_room_m
    blocked = ~columns.floor.ravel()
    blocked[columns.cell[(columns.z_m > low) & (columns.z_m < high)]] = True
    distance = ndimage.distance_transform_edt(~blocked.reshape(columns.floor.shape)) * CELL_M
    return Clearance(distance_m=distance, origin_m=columns.origin_m)
