"""Light baked into a home: lamps and windows with soft shadows, and the sky of the room itself darkened in corners.

Every patch carries a grid of light samples. Rays are followed through a grid of small boxes that are filled where
there is surface, which is exact enough for light and quick enough to be done anew for every home.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.synth.home.floor_plan import FloorPlan, Opening
from wsm_data.synth.home.furniture.piece import Lamp
from wsm_data.synth.render.surface import Surface

NODE_SPACING_M = 0.14
VOXEL_M = 0.05
_LIFT_M = 0.085
"""Rays start this far off their surface, so that its own voxels do not shade it, m."""

_SKY_REACH_M = 1.3
_GAMMA = 2.2
_DAYLIGHT = (1.0, 1.05, 1.12)
_AMBIENT = (0.30, 0.30, 0.315)
_FAINT = 0.004  # a source that adds less than this to the three channels is not followed


@dataclass(frozen=True, kw_only=True)
class LightGrid:
    """Light samples of all patches of a surface.

    Attributes:
        samples: light in display units (already gamma-coded), tint of the surface included; float64 [N, 3].
        patch: first sample, columns and rows of each surface patch; int64 [P, 3].
    """

    samples: Float64Array
    patch: NDArray[np.int64]


def bake(surface: Surface, points_m: Float64Array, plan: FloorPlan, lamps: tuple[Lamp, ...]) -> LightGrid:
    """Light on every patch of a home.

    Args:
        surface: all of it.
        points_m: points on it no farther apart than a voxel, [N, 3].
        plan: for its windows.
        lamps: in world coordinates.
    """
    filled, origin = _voxels(points_m)
    patch = _patches(surface)
    position, normal = _nodes(surface, patch)
    sources, powers, facing = _sources(plan, lamps)
    directions = _hemisphere()
    light = np.zeros_like(position)
    wanted = np.ones(len(position), np.bool_)
    wanted[patch[~surface.quad, 0] + 3] = False  # the fourth node of a triangle is outside it
    _gather(position, normal, filled, origin, sources, powers, facing, directions, np.array(_AMBIENT), wanted, light)
    tone = _tone(light)
    owner = np.repeat(np.arange(len(patch)), patch[:, 1] * patch[:, 2])
    emission = surface.emission[owner, None]
    samples = (tone * (1 - emission) + emission) * surface.tint[owner]
    return LightGrid(samples=_straight_triangles(samples, surface.quad, patch), patch=patch)


def _tone(light: Float64Array) -> Float64Array:
    """Linear light to display units: gamma, with a soft shoulder above 0.7."""
    display = np.maximum(light, 0.0) ** (1 / _GAMMA)
    over = np.maximum(display - 0.7, 0.0)
    return np.minimum(display, 0.7) + 0.45 * (1 - np.exp(-over / 0.45))


def _voxels(points_m: Float64Array) -> tuple[BoolArray, Float64Array]:
    """Which boxes of side VOXEL_M hold a point; [X, Y, Z], and the low corner of the first, m."""
    low = np.floor(points_m.min(axis=0) / VOXEL_M) * VOXEL_M - VOXEL_M
    size = np.ceil((points_m.max(axis=0) - low) / VOXEL_M).astype(int) + 1
    cell = ((points_m - low) / VOXEL_M).astype(np.int64)
    filled = np.zeros(int(size.prod()), np.bool_)
    filled[(cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]] = True
    return filled.reshape(*size), low


def _patches(surface: Surface) -> NDArray[np.int64]:
    """Columns and rows of nodes, closer than NODE_SPACING_M on parallelograms and 2 x 2 on triangles."""
    edges = np.linalg.norm(surface.points_m[:, 1:] - surface.points_m[:, :1], axis=-1)
    cells = np.where(surface.quad[:, None], np.clip(np.ceil(edges / NODE_SPACING_M), 1, 200), 1).astype(np.int64)
    nodes = cells + 1
    first = np.concatenate([[0], np.cumsum(nodes.prod(axis=1))[:-1]])
    return np.column_stack([first, nodes])


def _nodes(surface: Surface, patch: NDArray[np.int64]) -> tuple[Float64Array, Float64Array]:
    """Position and normal of every node; nodes on an edge are drawn in a little, out of what stands beside it."""
    counts = patch[:, 1] * patch[:, 2]
    owner = np.repeat(np.arange(len(patch)), counts)
    index = np.arange(len(owner)) - patch[owner, 0]
    column, row = index % patch[owner, 1], index // patch[owner, 1]
    s, t = column / (patch[owner, 1] - 1), row / (patch[owner, 2] - 1)
    points, normals = surface.points_m[owner], surface.normals[owner]
    edges = np.linalg.norm(points[:, 1:] - points[:, :1], axis=-1)
    inset = np.where(surface.quad[owner, None], np.minimum(0.04 / np.maximum(edges, 1e-9), 0.5), 0.02)
    s, t = np.clip(s, inset[:, 0], 1 - inset[:, 0])[:, None], np.clip(t, inset[:, 1], 1 - inset[:, 1])[:, None]
    position = points[:, 0] + s * (points[:, 1] - points[:, 0]) + t * (points[:, 2] - points[:, 0])
    normal = normals[:, 0] + s * (normals[:, 1] - normals[:, 0]) + t * (normals[:, 2] - normals[:, 0])
    return position, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def _straight_triangles(samples: Float64Array, quad: BoolArray, patch: NDArray[np.int64]) -> Float64Array:
    """Make light linear over triangles: their fourth node continues the plane of the other three."""
    first = patch[~quad, 0]
    samples[first + 3] = np.maximum(samples[first + 1] + samples[first + 2] - samples[first], 0.0)
    return samples


def _sources(plan: FloorPlan, lamps: tuple[Lamp, ...]) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Point lights: position [S, 3], power [S, 3], and the direction they face, 0 for all directions [S, 3]."""
    position, power, facing = [], [], []
    for lamp in lamps:
        for corner in ((1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0)):
            position.append(np.array(lamp.xyz_m) + lamp.radius_m * np.array(corner))
            power.append(np.array(lamp.power) / 4)
            facing.append(np.zeros(3))
    for opening in plan.openings:
        if opening.kind == "window":
            points, inward = _window_points(opening)
            area = (opening.end - opening.start) * (opening.z1 - opening.z0)
            for point in points:
                position.append(point)
                power.append(np.array(_DAYLIGHT) * 1.5 * area / len(points))
                facing.append(inward)
    return np.array(position), np.array(power), np.array(facing)


def _window_points(o: Opening) -> tuple[list[Float64Array], Float64Array]:
    across = (o.low - 0.02, 1.0) if o.outside > 0 else (o.high + 0.02, 1.0)
    sign = 1.0 if o.outside < 0 else -1.0
    inward = np.array([0.0, sign, 0.0] if o.axis == 0 else [sign, 0.0, 0.0])
    points = []
    for s in (0.2, 0.5, 0.8):
        for t in (0.25, 0.75):
            along, z = o.start + s * (o.end - o.start), o.z0 + t * (o.z1 - o.z0)
            xy = (along, across[0]) if o.axis == 0 else (across[0], along)
            points.append(np.array([*xy, z]))
    return points, inward


def _hemisphere(count: int = 18) -> Float64Array:
    """Cosine-weighted directions around +z: a spiral, the same at every node so that light is smooth."""
    i = np.arange(count) + 0.5
    radius, angle = np.sqrt(i / count), i * np.pi * (3 - np.sqrt(5))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - i / count)])


@njit(cache=True)  # type: ignore[untyped-decorator]
def _march(filled: BoolArray, origin: Float64Array, p: Float64Array, d: Float64Array, length: float) -> float:
    """Way a ray goes before it meets a filled box, at most `length`, in steps of 0.7 of a box.

    Filled boxes in which the ray starts do not stop it: they belong to what stands beside its surface.
    """
    step = 0.7 * VOXEL_M
    x, y, z = (p[0] - origin[0]) / VOXEL_M, (p[1] - origin[1]) / VOXEL_M, (p[2] - origin[2]) / VOXEL_M
    dx, dy, dz = 0.7 * d[0], 0.7 * d[1], 0.7 * d[2]
    outside = False
    nx, ny, nz = filled.shape
    for k in range(int(length / step)):
        i, j, m = int(x), int(y), int(z)
        if x < 0 or y < 0 or z < 0 or i >= nx or j >= ny or m >= nz:
            return length
        if not filled[np.uintp(i), np.uintp(j), np.uintp(m)]:  # unsigned: no test for counting from the end
            outside = True
        elif outside or k > 4:
            return k * step
        x += dx
        y += dy
        z += dz
    return length


@njit(cache=True)  # type: ignore[untyped-decorator]
def _gather(
    position: Float64Array,
    normal: Float64Array,
    filled: BoolArray,
    origin: Float64Array,
    sources: Float64Array,
    powers: Float64Array,
    facing: Float64Array,
    directions: Float64Array,
    ambient: Float64Array,
    wanted: BoolArray,
    light: Float64Array,
) -> None:
    """Linear light at the wanted nodes: what reaches it from the sources, and the ambient share that is not blocked."""
    d, start, side, other = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(position)):
        if not wanted[n]:
            continue
        nx, ny, nz = normal[n, 0], normal[n, 1], normal[n, 2]
        for k in range(3):
            start[k] = position[n, k] + _LIFT_M * normal[n, k]
        if abs(nz) < 0.9:
            length = np.sqrt(nx * nx + ny * ny)
            side[0], side[1], side[2] = -ny / length, nx / length, 0.0
        else:
            length = np.sqrt(ny * ny + nz * nz)
            side[0], side[1], side[2] = 0.0, nz / length, -ny / length
        other[0] = ny * side[2] - nz * side[1]
        other[1] = nz * side[0] - nx * side[2]
        other[2] = nx * side[1] - ny * side[0]
        open_share = 0.0
        for i in range(len(directions)):
            for k in range(3):
                d[k] = directions[i, 0] * side[k] + directions[i, 1] * other[k] + directions[i, 2] * normal[n, k]
            open_share += _march(filled, origin, start, d, _SKY_REACH_M) / _SKY_REACH_M
        open_share = 0.25 + 0.75 * open_share / len(directions)  # some light is thrown back by whatever blocks it
        for k in range(3):
            light[n, k] = ambient[k] * open_share
        for s in range(len(sources)):
            distance2 = 0.0
            for k in range(3):
                d[k] = sources[s, k] - start[k]
                distance2 += d[k] * d[k]
            if distance2 > 64.0 or distance2 < 1e-6:
                continue
            distance = np.sqrt(distance2)
            cosine = (d[0] * nx + d[1] * ny + d[2] * nz) / distance
            if cosine <= 0.0:
                continue
            strength = cosine / (distance2 + 0.25)
            if facing[s, 0] != 0.0 or facing[s, 1] != 0.0:
                strength *= max(0.0, -(d[0] * facing[s, 0] + d[1] * facing[s, 1]) / distance)
            if strength * (powers[s, 0] + powers[s, 1] + powers[s, 2]) < _FAINT:
                continue
            for k in range(3):
                d[k] /= distance
            if _march(filled, origin, start, d, distance - 0.12) >= distance - 0.12:
                for k in range(3):
                    light[n, k] += powers[s, k] * strength
