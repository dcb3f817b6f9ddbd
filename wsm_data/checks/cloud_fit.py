"""How a cloud that disagrees with depth may be misplaced: what is tried, and what fits.

A placement is named only where it explains nearly all points and the cloud as it is explains far fewer.
"""

import numpy as np

from wsm_data.maps.near_surface import near_surface
from wsm_data.maps.scene_map import FloorLevel
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.surface import CELL_SIZE_M

FITS_SHARE = 0.85
"""A placement fits that brings so many of the points to the cloud,"""

BETTER_BY = 0.25
"""and so many more than lie there without it."""

MIN_POINTS = 200
"""From so many points a share is told."""

_AXES = {
    "stored with y up": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "stored with y down": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "mirrored along x": ((-1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "mirrored along y": ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "turned by 90 degrees": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "turned by -90 degrees": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "turned by 180 degrees": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "10 times too large": ((10, 0, 0), (0, 10, 0), (0, 0, 10)),
    "in centimetres": ((100, 0, 0), (0, 100, 0), (0, 0, 100)),
    "in millimetres": ((1000, 0, 0), (0, 1000, 0), (0, 0, 1000)),
}

_HEIGHTS_M = np.arange(-2.0, 2.0 + 1e-9, 0.05)


def fitting_placement(level: FloorLevel, points_m: Float64Array, upright_m: Float64Array) -> str | None:
    """How the cloud is misplaced, in words; None where none fits clearly better.

    Args:
        level: the surface of the cloud around a floor; what lies beyond its heights cannot be told.
        points_m: points of depth images in the world, m; float64 [N, 3].
        upright_m: those of them above the floor, which tell a shift along it; float64 [M, 3].
    """
    if level.shape[0] * level.shape[1] == 0:
        return None
    moved = {name: points_m @ np.array(axes, np.float64).T for name, axes in _AXES.items()}
    dz = _best_height_m(level, points_m)
    moved[f"{dz:+.2f} m too high"] = points_m + np.array([0, 0, dz])
    if len(upright_m) >= MIN_POINTS:
        dx, dy = _best_shift_m(level, upright_m)
        moved[f"shifted by ({dx:+.2f}, {dy:+.2f}) m"] = points_m + np.array([dx, dy, 0])
    shares = {name: _share(level, points) for name, points in moved.items()}
    best = max(shares, key=lambda name: shares[name])
    enough = max(FITS_SHARE, _share(level, points_m) + BETTER_BY)
    return best if shares[best] >= enough else None


def _share(level: FloorLevel, points_m: Float64Array) -> float:
    """Share of the points near the surface, of those at heights that the level holds."""
    low_m, high_m = level.floor_z_m - 0.25, level.floor_z_m + 1.5
    held = points_m[(points_m[:, 2] > low_m) & (points_m[:, 2] < high_m)]
    return float(np.mean(near_surface(level, held))) if len(held) >= MIN_POINTS else 0.0


def _best_height_m(level: FloorLevel, points_m: Float64Array) -> float:
    """The middle of the heights by which lifted points lie at the surface most often, m."""
    shares = np.array([_share(level, points_m + np.array([0, 0, dz])) for dz in _HEIGHTS_M.tolist()])
    return float(np.mean(_HEIGHTS_M[shares >= shares.max() - 0.01]))


def _best_shift_m(level: FloorLevel, upright_m: Float64Array) -> tuple[float, float]:
    """The shift over the floor, in whole cells, that brings most cells with upright points onto tall cells, m."""
    rows, columns = level.shape
    tall = (np.diff(level.first) > 3).reshape(rows, columns).astype(np.float64)
    cells = np.unique(np.floor(upright_m[:, :2] / CELL_SIZE_M).astype(np.int64), axis=0)
    low = cells.min(axis=0)
    width, height = (int(n) for n in np.ptp(cells, axis=0) + 1)
    seen = np.zeros((height, width))
    seen[cells[:, 1] - low[1], cells[:, 0] - low[0]] = 1
    shape = (rows + height, columns + width)  # padded, so that nothing wraps around
    product = np.fft.rfft2(tall, shape) * np.conj(np.fft.rfft2(seen, shape))
    row, column = (int(n) for n in np.unravel_index(np.argmax(np.fft.irfft2(product, shape)), shape))
    row, column = row - shape[0] * (row >= rows), column - shape[1] * (column >= columns)
    dx, dy = column + level.origin_cell[0] - int(low[0]), row + level.origin_cell[1] - int(low[1])
    return dx * CELL_SIZE_M, dy * CELL_SIZE_M
