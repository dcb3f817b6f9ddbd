"""A two-dimensional map of what a robot may drive over."""

import math
from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float64Array, Uint8Array, frozen_array, require_array

FREE, OCCUPIED, UNKNOWN = 0, 1, 255


@dataclass(frozen=True, kw_only=True)
class OccupancyGrid:
    """Cells over the floor of the world; row is y, column is x.

    Cell (row, column) covers [x0 + column r, x0 + (column + 1) r) x [y0 + row r, ...), where (x0, y0) is
    `origin_xy_m` and r the resolution. Maps stand on the world's own grid, so the origin is a whole number of cells.

    Attributes:
        cells: FREE, OCCUPIED or UNKNOWN; uint8 [Y, X].
        origin_cell: (ix, iy) of the first column and row on the world's grid.
        resolution_m: side of a cell, m.
    """

    cells: Uint8Array
    origin_cell: tuple[int, int]
    resolution_m: float

    def __post_init__(self) -> None:
        require_array("cells", self.cells, np.uint8, (None, None))
        if not np.isin(self.cells, (FREE, OCCUPIED, UNKNOWN)).all():
            raise ValueError(f"cells must be {FREE}, {OCCUPIED} or {UNKNOWN}, found {np.unique(self.cells).tolist()}")
        if not (self.resolution_m > 0 and math.isfinite(self.resolution_m)):
            raise ValueError(f"resolution_m must be a positive length, found {self.resolution_m}")
        object.__setattr__(self, "cells", frozen_array(self.cells))

    @property
    def origin_xy_m(self) -> tuple[float, float]:
        """World position of the lower corner of cell (0, 0), m."""
        return self.origin_cell[0] * self.resolution_m, self.origin_cell[1] * self.resolution_m

    def fractional_cells(self, xy_m: Float64Array) -> Float64Array:
        """World positions [..., 2] (m) as fractional (column, row), where whole numbers are cell centres."""
        return np.asarray(xy_m) / self.resolution_m - np.array(self.origin_cell) - 0.5

    def cell_centres_xy_m(self, columns_rows: Float64Array) -> Float64Array:
        """Inverse of `fractional_cells`: (column, row) [..., 2] to world positions, m."""
        return (np.asarray(columns_rows) + np.array(self.origin_cell) + 0.5) * self.resolution_m
