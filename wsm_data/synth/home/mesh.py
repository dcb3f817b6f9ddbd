"""From patches, textures and light to what the renderer draws."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.home.lighting import LightGrid
from wsm_data.synth.render.atlas import Atlas, pack_colours
from wsm_data.synth.render.rasteriser import LIGHT_BITS
from wsm_data.synth.render.render import RenderMesh
from wsm_data.synth.render.surface import Surface

_LIGHT_ONE = 512


def build_mesh(surface: Surface, cluster_sizes: Sequence[int], atlas: Atlas, light: LightGrid) -> RenderMesh:
    """Triangles of all patches; `cluster_sizes` are the numbers of consecutive patches that belong together."""
    owner, corner = _triangles(surface)
    points = corner_values(surface.points_m, corner, owner)
    size = 1 << atlas.size_bits[surface.texture]
    uv = _positive(surface.uv) * size[:, None, None]
    nodes = light.patch[:, 1:] - 1
    st = np.zeros_like(uv)
    st[:, 1, 0], st[:, 2, 1] = nodes[:, 0], nodes[:, 1]
    cluster_of_patch = np.repeat(np.arange(len(cluster_sizes)), cluster_sizes)
    start, sphere = _clusters(points, cluster_of_patch[owner], len(cluster_sizes))
    samples = np.clip(np.round(light.samples * _LIGHT_ONE), 0, (1 << LIGHT_BITS) - 1)
    return RenderMesh(
        points_m=np.ascontiguousarray(points),
        uv_texel=np.ascontiguousarray(corner_values(uv, corner, owner)),
        light_st=np.ascontiguousarray(corner_values(st, corner, owner)),
        texture=np.ascontiguousarray(surface.texture[owner]),
        two_sided=np.ascontiguousarray(surface.two_sided[owner]),
        light_patch=np.ascontiguousarray(light.patch[owner]),
        texels=atlas.texels,
        level_offsets=atlas.level_offsets,
        size_bits=atlas.size_bits,
        light=pack_colours(samples),
        cluster_start=start,
        cluster_sphere=sphere,
    )


def _triangles(surface: Surface) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Patch of each triangle, and its corners out of a, b, d, c; a parallelogram gives a b c and a c d."""
    owner = np.repeat(np.arange(len(surface)), np.where(surface.quad, 2, 1))
    second = np.zeros(len(owner), np.bool_)
    second[1:] = owner[1:] == owner[:-1]
    corner = np.tile(np.array([0, 1, 2]), (len(owner), 1))
    corner[surface.quad[owner] & ~second] = (0, 1, 3)
    corner[second] = (0, 3, 2)
    return owner, corner


def corner_values(values: Float64Array, corner: NDArray[np.int64], owner: NDArray[np.int64]) -> Float64Array:
    """Values at a, b, d [P, 3, K] gathered for triangles [F, 3, K]; c continues the plane: b + d - a."""
    fourth = values[:, 1] + values[:, 2] - values[:, 0]
    return np.concatenate([values, fourth[:, None]], axis=1)[owner[:, None], corner]


def _positive(uv: Float64Array) -> Float64Array:
    """Texture coordinates moved by whole repeats to where nothing, c included, is below 1."""
    fourth = uv[:, 1] + uv[:, 2] - uv[:, 0]
    lowest = np.minimum(uv.min(axis=1), fourth)
    return uv - np.floor(lowest)[:, None] + 1.0


def _clusters(points: Float64Array, cluster: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], Float64Array]:
    """First triangle of each cluster and F; centre and radius of a sphere around each."""
    start = np.searchsorted(cluster, np.arange(count + 1))
    sphere = np.zeros((count, 4))
    for i in range(count):
        corners = points[start[i] : start[i + 1]].reshape(-1, 3)
        centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
        sphere[i] = (*centre, np.linalg.norm(corners - centre, axis=1).max() + 1e-6)
    return start.astype(np.int64), sphere
