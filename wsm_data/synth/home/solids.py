"""Solids that furniture is built of: boxes, lathed and round bodies, tubes, sheets."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.render.surface import Material, Point, Surface, make_surface, parallelograms

_FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
# per face: which corner of the box it starts from (0 low, 1 high), and the directions of its edges; u x v is outward
_STARTS = np.array([(1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 0), (0, 0, 1), (0, 1, 0)])
_EDGES_U = np.array([(0, 1, 0), (0, -1, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)], np.float64)
_EDGES_V = np.array([(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 1, 0), (0, -1, 0)], np.float64)


def box(low_m: Point, high_m: Point, material: Material, skip: Sequence[str] = (), fit: Sequence[str] = ()) -> Surface:
    """An upright box between two corners.

    Args:
        low_m: corner with the smallest coordinates, m.
        high_m: opposite corner, m.
        material: of all faces.
        skip: faces that are never seen, such as `-z` for what stands on the floor.
        fit: faces that the texture covers exactly once.
    """
    low, high = np.array(low_m, np.float64), np.array(high_m, np.float64)
    kept = np.array([name not in skip for name in _FACES])
    covered = np.array([name in fit for name in _FACES])[kept]
    starts, size = np.where(_STARTS[kept] == 1, high, low), high - low
    return parallelograms(starts, _EDGES_U[kept] * size, _EDGES_V[kept] * size, material, fit=covered)


def block(
    centre_xy_m: tuple[float, float], z_m: float, size_m: Point, material: Material, **kwargs: Sequence[str]
) -> Surface:
    """A box given by the centre of its underside and its size; further arguments as for `box`."""
    (x, y), (w, d, h) = centre_xy_m, size_m
    return box((x - w / 2, y - d / 2, z_m), (x + w / 2, y + d / 2, z_m + h), material, **kwargs)


def grid_surface(points_m: Float64Array, normals: Float64Array, uv: Float64Array, material: Material) -> Surface:
    """Triangles over a grid of points [M, N, 3] with normals [M, N, 3] and texture coordinates [M, N, 2]."""
    corners = [(slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1))]
    corners += [(slice(1, None), slice(1, None)), (slice(None, -1), slice(1, None))]

    def triangles(array: Float64Array) -> Float64Array:
        p, q, r, s = (array[corner].reshape(-1, array.shape[-1]) for corner in corners)
        return np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])

    points = triangles(points_m)
    area = np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)
    keep = area > 1e-9  # at the poles of round bodies one of the two triangles is a line
    return make_surface(points[keep], triangles(normals)[keep], triangles(uv)[keep], False, material)


def lathe(profile_m: Sequence[tuple[float, float]], material: Material, sides: int = 14) -> Surface:
    """A body of revolution about z; the profile lists (radius, z) from the bottom up, corners twice to stay sharp."""
    profile = np.array(profile_m, np.float64)
    tangent = _profile_tangents(profile)
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    angle[-1] = 0.0  # the seam closes to the bit
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    radius, z = profile[:, 0], np.broadcast_to(profile[:, 1], (sides + 1, len(profile)))
    points = np.stack([c * radius, s * radius, z], axis=-1)
    normals = np.stack([c * tangent[:, 1], s * tangent[:, 1], np.broadcast_to(-tangent[:, 0], z.shape)], axis=-1)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    around = np.linspace(0.0, 2 * np.pi * profile[:, 0].max(), sides + 1)[:, None]
    uv = np.stack([np.broadcast_to(around, z.shape), np.broadcast_to(-length, z.shape)], axis=-1) / material.repeat_m
    return grid_surface(points, normals, uv, material)


def _profile_tangents(profile: Float64Array) -> Float64Array:
    """Unit direction of the profile at its points, one-sided where a point stands twice."""
    step = np.diff(profile, axis=0)
    length = np.linalg.norm(step, axis=1, keepdims=True)
    unit = np.divide(step, length, out=np.zeros_like(step), where=length > 0)
    before, after = np.vstack([unit[:1], unit]), np.vstack([unit, unit[-1:]])
    total = before + after
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def tube(start_m: Point, end_m: Point, radius_m: float, material: Material, sides: int = 8) -> Surface:
    """A round bar between two points, open at its ends."""
    a, b = np.array(start_m, np.float64), np.array(end_m, np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    angle[-1] = 0.0
    ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(axis, side)
    points = np.stack([a + radius_m * ring, b + radius_m * ring], axis=1)
    around = np.linspace(0.0, 2 * np.pi * radius_m, sides + 1)
    along = np.array([0.0, float(np.linalg.norm(b - a))])
    uv = np.stack(np.broadcast_arrays(along[None, :], around[:, None]), axis=-1) / material.repeat_m
    return grid_surface(points, np.stack([ring, ring], axis=1), uv, material)


def cushion(
    centre_m: Point, size_m: Point, material: Material, squareness: float = 0.35, rings: int = 6, sides: int = 12
) -> Surface:
    """A rounded body that fills a box: a superellipsoid (Barr 1981); squareness 1 is an ellipsoid, towards 0 a box."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)[None, :]
    longitude = np.linspace(0.0, 2 * np.pi, sides + 1)[:, None]
    e = squareness
    half = np.array(size_m, np.float64) / 2

    def power(value: Float64Array, exponent: float) -> Float64Array:
        clean = np.where(np.abs(value) < 1e-12, 0.0, value)
        return np.sign(clean) * np.abs(clean) ** exponent

    def body(exponent: float) -> Float64Array:
        flat = power(np.cos(latitude), exponent)
        xyz = (flat * power(np.cos(longitude), exponent), flat * power(np.sin(longitude), exponent))
        return np.stack(np.broadcast_arrays(*xyz, power(np.sin(latitude), exponent)), axis=-1)

    points = np.array(centre_m) + half * body(e)
    points[-1] = points[0]
    normals = body(2.0 - e) / half
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    return _box_mapped(grid_surface(points, normals, np.zeros((*points.shape[:2], 2)), material), material)


def _box_mapped(surface: Surface, material: Material) -> Surface:
    """The triangles with their texture laid on along the axis they face most, so that it has no poles."""
    p = surface.points_m
    facing = np.abs(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])).argmax(axis=1)
    axes = np.array([(1, 2), (0, 2), (0, 1)])[facing]
    uv = np.take_along_axis(p, np.repeat(axes[:, None], 3, axis=1), axis=2) / material.repeat_m
    return replace(surface, uv=uv)


def sheet(
    shape: Callable[[Float64Array, Float64Array], tuple[Float64Array, Float64Array, Float64Array]],
    cells: tuple[int, int],
    material: Material,
    repeats: tuple[float, float] = (1.0, 1.0),
) -> Surface:
    """A curved sheet: `shape` maps s, t in [0, 1] (arrays [M, N]) to x, y, z; the front shows d/ds x d/dt."""
    s, t = np.meshgrid(np.linspace(0, 1, cells[0] + 1), np.linspace(0, 1, cells[1] + 1), indexing="ij")
    points = np.stack(np.broadcast_arrays(*shape(s, t)), axis=-1).astype(np.float64)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    uv = np.stack([s * repeats[0], (1 - t) * repeats[1]], axis=-1)
    return grid_surface(points, normals, uv, material)
