"""The block cosine transform of the `dct` codec, compiled: one plane of four frames at a time.

Sums run in the written order, in float32, without fused or reordered operations, so the bits depend neither on the
number of threads nor on the processor. A coefficient is a row (t, y, x) of frequencies; only the listed ones are
computed or read. A plane is float32 [4, H, W], coefficients are float32 [n, H / 16, W / 16].
"""

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float32Array, Int16Array

FRAMES = 4
SIDE = 16


def cosine_basis(length: int) -> Float32Array:
    """Orthonormal DCT-II of `length` points, float32 [frequency, position]."""
    frequency, position = np.mgrid[:length, :length]
    basis = np.cos(np.pi * (2 * position + 1) * frequency / (2 * length)) * np.sqrt(2 / length)
    basis[0] = np.sqrt(1 / length)
    return basis.astype(np.float32)


@njit(cache=True)  # type: ignore[untyped-decorator]
def forward(
    plane: Float32Array, frequencies: Int16Array, in_time: Float32Array, in_space: Float32Array, out: Float32Array
) -> None:
    """Fill `out` with the coefficients of every block of `plane`."""
    width = plane.shape[2]
    rows = np.empty((SIDE, width), np.float32)  # one row of blocks, at one temporal frequency
    columns = np.empty(width, np.float32)
    for block_row in range(plane.shape[1] // SIDE):
        last_t, last_y = -1, -1
        for n in range(len(frequencies)):
            t, y, x = frequencies[n]
            if t != last_t:
                _project_time(plane, block_row, in_time[t], rows)
            if t != last_t or y != last_y:
                _project_rows(rows, in_space[y], columns)
            last_t, last_y = t, y
            for block in range(width // SIDE):
                total = np.float32(0)
                for i in range(SIDE):
                    total += in_space[x, i] * columns[block * SIDE + i]
                out[n, block_row, block] = total


@njit(cache=True)  # type: ignore[untyped-decorator]
def _project_time(plane: Float32Array, block_row: int, weights: Float32Array, rows: Float32Array) -> None:
    for i in range(SIDE):
        y = block_row * SIDE + i
        for x in range(plane.shape[2]):
            total = weights[0] * plane[0, y, x]
            for frame in range(1, FRAMES):
                total += weights[frame] * plane[frame, y, x]
            rows[i, x] = total


@njit(cache=True)  # type: ignore[untyped-decorator]
def _project_rows(rows: Float32Array, weights: Float32Array, columns: Float32Array) -> None:
    columns[:] = np.float32(0)
    for i in range(SIDE):
        for x in range(rows.shape[1]):
            columns[x] += weights[i] * rows[i, x]


@njit(cache=True)  # type: ignore[untyped-decorator]
def inverse(
    coefficients: Float32Array,
    frequencies: Int16Array,
    in_time: Float32Array,
    in_space: Float32Array,
    out: Float32Array,
) -> None:
    """Fill the plane `out` with the sum of the listed cosines, each times its coefficient."""
    width = out.shape[2]
    out[:] = np.float32(0)
    columns = np.empty(width, np.float32)
    for block_row in range(out.shape[1] // SIDE):
        start = 0
        while start < len(frequencies):  # a run of equal (t, y) shares its way back through rows and frames
            t, y = frequencies[start, 0], frequencies[start, 1]
            columns[:] = np.float32(0)
            stop = start
            while stop < len(frequencies) and frequencies[stop, 0] == t and frequencies[stop, 1] == y:
                _spread_columns(coefficients[stop, block_row], in_space[frequencies[stop, 2]], columns)
                stop += 1
            _spread_rows(columns, in_space[y], in_time[t], block_row, out)
            start = stop


@njit(cache=True)  # type: ignore[untyped-decorator]
def _spread_columns(row: Float32Array, weights: Float32Array, columns: Float32Array) -> None:
    for block in range(len(row)):
        for i in range(SIDE):
            columns[block * SIDE + i] += weights[i] * row[block]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _spread_rows(
    columns: Float32Array, in_y: Float32Array, in_time: Float32Array, block_row: int, out: Float32Array
) -> None:
    for frame in range(FRAMES):
        for i in range(SIDE):
            weight = in_time[frame] * in_y[i]
            for x in range(len(columns)):
                out[frame, block_row * SIDE + i, x] += weight * columns[x]
