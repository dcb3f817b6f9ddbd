"""Points to surface boxes: what is kept of a scene cloud, or of depth images fused over a scene."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numba import njit

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.maps.arrays_file import arrays_digest, load_arrays, save_arrays
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array
from wsm_data.schema.dataset import CloudColours
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.surface import CELL_SIZE_M, LAYER_HEIGHT_M, SurfaceVoxels

_CELLS_PER_M = round(1 / CELL_SIZE_M)
_LAYERS_PER_M = round(1 / LAYER_HEIGHT_M)
_NAMES = ("cells", "obstacle", "origin")
_LIMIT = 1 << 15

# A box as one number, so that boxes sort by it: 16 bits each of ix, iy and iz above the obstacle flag.
_BIAS = np.array([_LIMIT, _LIMIT, _LIMIT])
_SHIFTS = np.array([33, 17, 1])


def voxels_from_cloud(cloud: PointCloud, colours: CloudColours) -> SurfaceVoxels:
    """Boxes that hold points of a scene cloud. A path drawn into the cloud was taken out when it was read.

    Raises:
        DataError: `cloud.empty` when there is no point, `cloud.no_obstacles` when none has the obstacle
            colour, `cloud.unreadable` when a coordinate is not finite or farther out than the grid of boxes reaches.
    """
    obstacle_rgb = np.array(colours.obstacle_rgb) * 255
    keys, bad = _cloud_keys(cloud.xyz_m, cloud.rgb_u8, obstacle_rgb, colours.tolerance * 255)
    if bad >= 0:
        raise _off_the_grid("a point of the cloud", bad, cloud.xyz_m[bad])
    if not len(keys):
        raise DataError(
            Reason.CLOUD_EMPTY,
            "a scene cloud must hold points of the scene, found none; has it none but the path's?",
            {"points": 0},
        )
    if not (keys & 1).any():
        raise DataError(
            Reason.CLOUD_NO_OBSTACLES,
            f"a scene cloud must mark obstacles in the colour {colours.obstacle_rgb} (within {colours.tolerance}), "
            f"found none among {len(keys)} points; is it another cloud, or coloured by another convention?",
            {"points": len(keys)},
        )
    return _from_keys(_unique(keys), "cloud")


def voxels_from_depth(chunks_world_m: Iterable[Float64Array]) -> SurfaceVoxels:
    """Boxes that hold points of depth images; none is marked as an obstacle.

    Args:
        chunks_world_m: points in the world, m, float64 [N, 3] a chunk, such as one frame each. However the points are
            cut into chunks, the boxes are the same; memory grows with the boxes, not with the points.

    Raises:
        DataError: `cloud.unreadable` when a coordinate is not finite or farther out than the grid of boxes reaches.
    """
    merged = np.zeros(0, np.int64)
    waiting: list[np.ndarray] = []
    for points in chunks_world_m:
        keys, bad = _point_keys(np.ascontiguousarray(points, np.float64))
        if bad >= 0:
            raise _off_the_grid("a point of the fused depth", bad, points[bad])
        waiting.append(_unique(keys))
        # merging only when as much waits as is merged keeps the total work at O(n log n)
        if sum(map(len, waiting)) > max(len(merged), 1 << 18):
            merged, waiting = _unique(np.concatenate([merged, *waiting])), []
    return _from_keys(_unique(np.concatenate([merged, *waiting])), "depth")


def no_voxels() -> SurfaceVoxels:
    """The surface of a scene that neither a cloud nor depth shows."""
    return _from_keys(np.zeros(0, np.int64), "path")


def save_voxels(path: Path, voxels: SurfaceVoxels) -> None:
    """Write boxes to an .npz file, atomically; equal boxes give equal bytes."""
    save_arrays(path, _arrays(voxels))


def load_voxels(path: Path) -> SurfaceVoxels:
    """Read what `save_voxels` wrote.

    Raises:
        IntegrityError: the file is damaged or holds something else.
    """
    arrays = load_arrays(path, _NAMES)
    try:
        return SurfaceVoxels(cells=arrays["cells"], obstacle=arrays["obstacle"], origin=str(arrays["origin"]))
    except ValueError as error:
        raise IntegrityError(f"{path} does not hold surface boxes: {error}") from error


def voxels_digest(voxels: SurfaceVoxels) -> str:
    """Return the sha256 of the content of the boxes, in hexadecimal."""
    return arrays_digest(_arrays(voxels))


def _arrays(voxels: SurfaceVoxels) -> dict[str, np.ndarray]:
    return {"cells": voxels.cells, "obstacle": voxels.obstacle, "origin": np.array(voxels.origin)}


def _off_the_grid(what: str, index: int, xyz_m: np.ndarray) -> DataError:
    reach_m = (_LIMIT / _CELLS_PER_M, _LIMIT / _CELLS_PER_M, _LIMIT / _LAYERS_PER_M)
    found = [float(v) for v in xyz_m]
    return DataError(
        Reason.CLOUD_UNREADABLE,
        f"{what} must be finite and within {reach_m} m of the world's origin, found {found} m at index {index}; "
        "is the unit metres?",
        {"index": int(index), "xyz_m": [str(v) for v in found]},
    )


def _unique(keys: np.ndarray) -> np.ndarray:
    """Sorted keys, each box once; of two that differ in the obstacle flag alone the one that has it stays."""
    keys = np.sort(keys)
    last_of_box = np.ones(len(keys), np.bool_)
    last_of_box[:-1] = keys[:-1] >> 1 != keys[1:] >> 1
    return keys[last_of_box]


def _from_keys(keys: np.ndarray, origin: str) -> SurfaceVoxels:
    cells = ((keys[:, None] >> _SHIFTS) & 0xFFFF) - _BIAS
    return SurfaceVoxels(cells=cells.astype(np.int16), obstacle=(keys & 1).astype(np.bool_), origin=origin)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _key(x: float, y: float, z: float) -> int:
    """Key of the box around a point, without flag; -1 where there is none (NaN fails every comparison)."""
    ix, iy, iz = np.floor(x * _CELLS_PER_M), np.floor(y * _CELLS_PER_M), np.floor(z * _LAYERS_PER_M)
    inside = -_LIMIT <= ix < _LIMIT and -_LIMIT <= iy < _LIMIT and -_LIMIT <= iz < _LIMIT
    if not inside:
        return -1
    return ((int(ix) + _LIMIT) << 33) | ((int(iy) + _LIMIT) << 17) | ((int(iz) + _LIMIT) << 1)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _point_keys(xyz_m: Float64Array) -> tuple[np.ndarray, int]:
    """Keys of all points, and the index of the first that has none (-1: all have)."""
    keys = np.empty(len(xyz_m), np.int64)
    for i in range(len(xyz_m)):
        keys[i] = _key(xyz_m[i, 0], xyz_m[i, 1], xyz_m[i, 2])
        if keys[i] < 0:
            return keys, i
    return keys, -1


@njit(cache=True)  # type: ignore[untyped-decorator]
def _cloud_keys(
    xyz_m: Float32Array, rgb_u8: Uint8Array, obstacle_rgb: Float64Array, tolerance: float
) -> tuple[np.ndarray, int]:
    """Keys with flags of all points, and the index of the first that has none (-1: all have)."""
    keys = np.empty(len(xyz_m), np.int64)
    for i in range(len(xyz_m)):
        to_obstacle = 0.0
        for channel in range(3):
            to_obstacle += abs(rgb_u8[i, channel] - obstacle_rgb[channel])
        key = _key(float(xyz_m[i, 0]), float(xyz_m[i, 1]), float(xyz_m[i, 2]))
        if key < 0:
            return keys, i
        keys[i] = key | (to_obstacle < tolerance)
    return keys, -1
