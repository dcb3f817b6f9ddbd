"""Points on surfaces, evenly spread."""

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.surface import Surface


def sample_surface(surface: Surface, spacing_m: float) -> tuple[Float64Array, NDArray[np.int64]]:
    """Points on every patch on a regular grid, its edges included, no farther apart than `spacing_m`.

    Every patch, however small, gets points, and none of its points is off it.

    Returns:
        Points [N, 3], m, and the patch of each [N].
    """
    edges = np.linalg.norm(surface.points_m[:, 1:] - surface.points_m[:, :1], axis=-1)
    cells = np.maximum(np.ceil(edges / spacing_m), 1).astype(np.int64)
    nodes = cells + 1
    counts = nodes.prod(axis=1)
    owner = np.repeat(np.arange(len(surface)), counts)
    index = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    s = (index % nodes[owner, 0]) / cells[owner, 0]
    t = (index // nodes[owner, 0]) / cells[owner, 1]
    keep = surface.quad[owner] | (s + t <= 1 + 1e-9)
    owner, s, t = owner[keep], s[keep, None], t[keep, None]
    a, b, d = (surface.points_m[owner, k] for k in range(3))
    return a + s * (b - a) + t * (d - a), owner
