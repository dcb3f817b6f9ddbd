"""From a geodesic field to the expert's distance, and to the millimetres that are stored."""

import numpy as np

from wsm_data.schema.arrays import Float32Array, Float64Array, Uint16Array
from wsm_data.schema.clip import UNREACHABLE_MM
from wsm_data.schema.occupancy import OccupancyGrid


def sample_distance(field_m: Float32Array, grid: OccupancyGrid, xy_m: Float64Array) -> Float64Array:
    """Distance D at continuous positions, interpolated between the four nearest cell centres.

    Bilinear; neighbours without a distance are left out and the weights of the others scaled to one. A position whose
    neighbours all lie in the goal region has distance zero, exactly.

    Args:
        field_m: distances of the cells, m; float32 [Y, X], infinite where there is none.
        grid: the map the field belongs to.
        xy_m: positions in the world, m; [T, 2].

    Returns:
        float64 [T], m; infinite where no neighbour with a positive weight has a distance.
    """
    if field_m.shape != grid.cells.shape:
        raise ValueError(f"a field of shape {field_m.shape} does not belong to a map of shape {grid.cells.shape}")
    cells = grid.fractional_cells(np.asarray(xy_m, np.float64))
    lower = np.floor(cells).astype(np.int64)
    upper_weight = cells - lower
    padded = np.pad(field_m.astype(np.float64), 1, constant_values=np.inf)
    total, weights = np.zeros(len(cells)), np.zeros(len(cells))
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x = np.clip(lower[:, 0] + dx + 1, 0, padded.shape[1] - 1)
        y = np.clip(lower[:, 1] + dy + 1, 0, padded.shape[0] - 1)
        value = padded[y, x]
        weight = np.abs(1 - dx - upper_weight[:, 0]) * np.abs(1 - dy - upper_weight[:, 1]) * np.isfinite(value)
        total += weight * np.where(weight > 0, value, 0.0)
        weights += weight
    return np.where(weights > 0, total / np.where(weights > 0, weights, 1.0), np.inf)


def field_to_mm(field_m: Float32Array) -> Uint16Array:
    """Distances in m to the stored uint16 millimetres: rounded, 65534 at most, 65535 where there is none."""
    mm = np.minimum(np.rint(field_m.astype(np.float64) * 1000), UNREACHABLE_MM - 1)
    return np.where(np.isfinite(field_m), mm, UNREACHABLE_MM).astype(np.uint16)


def mm_to_field(geodesic_mm: Uint16Array) -> Float32Array:
    """Inverse of `field_to_mm`, to half a millimetre: float32 [Y, X], m, infinite where there is no distance."""
    return np.where(geodesic_mm == UNREACHABLE_MM, np.inf, geodesic_mm / 1000.0).astype(np.float32)


def progress(distance_m: Float64Array) -> Float64Array:
    """Progress of each step towards the goal, D(l - 1) - D(l), m; [T] to [T - 1] (paper, appendix on post-training)."""
    return np.asarray(distance_m, np.float64)[:-1] - np.asarray(distance_m, np.float64)[1:]
