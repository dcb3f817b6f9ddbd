"""The compiled core of the renderer: which triangle each pixel sees, how far away, and in which colour.

Visibility follows Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates" (1997): with the
camera at the origin and corners v0, v1, v2, the ray r through a pixel meets the triangle where r . (v1 x v2),
r . (v2 x v0) and r . (v0 x v1) have the sign of the determinant v0 . (v1 x v2), and their sum over the determinant
is 1 / z. All are linear in the pixel, hold for corners behind the camera too, and neighbours that share an edge
compute it with exactly opposite signs, so there are no gaps between them and nothing has to be clipped.

Colours are packed into one int64 with 16 bits a channel, so that one multiplication weighs all three.
"""

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array

NEAR_M = 0.01
"""Surfaces nearer than this to the camera plane are not drawn, m."""

LIGHT_BITS = 10  # of a light sample, of which 512 stands for 1; its interpolation weights have 6 bits
LANES_OF_13 = 0x1FFF1FFF1FFF  # three channels of 13 bits in lanes of 16
PLANES = 17  # per drawn triangle: u/z, v/z, s/z, t/z, 1/z as planes over the image, texel area, number
SPAN = 8  # pixels over which texture and light coordinates are taken for straight


@njit(cache=True)  # type: ignore[untyped-decorator]
def _cluster_is_visible(sphere: Float64Array, M: Float64Array, limits: Float64Array) -> bool:
    """Whether a bounding sphere (x, y, z, radius) reaches into the view, whose four side planes are in `limits`."""
    x = M[0, 0] * sphere[0] + M[0, 1] * sphere[1] + M[0, 2] * sphere[2] + M[0, 3]
    y = M[1, 0] * sphere[0] + M[1, 1] * sphere[1] + M[1, 2] * sphere[2] + M[1, 3]
    z = M[2, 0] * sphere[0] + M[2, 1] * sphere[1] + M[2, 2] * sphere[2] + M[2, 3]
    if z < -sphere[3]:
        return False
    for i in range(4):  # noqa: SIM110  numba compiles no generators
        if limits[i, 0] * x + limits[i, 1] * y + limits[i, 2] * z < -sphere[3]:
            return False
    return True


@njit(cache=True)  # type: ignore[untyped-decorator]
def _camera_corners(corners: Float64Array, M: Float64Array, v: Float64Array) -> None:
    for i in range(3):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        for k in range(3):
            v[i, k] = M[k, 0] * x + M[k, 1] * y + M[k, 2] * z + M[k, 3]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _image_bounds(v: Float64Array, fx: float, fy: float, cx: float, cy: float, bounds: Float64Array) -> bool:
    """Bounds (x0, x1, y0, y1) in pixels of the part in front of the near plane; False where there is none."""
    bounds[0], bounds[1], bounds[2], bounds[3] = np.inf, -np.inf, np.inf, -np.inf
    seen = False
    for i in range(3):
        j = (i + 1) % 3
        zi, zj = v[i, 2], v[j, 2]
        if zi >= NEAR_M:
            seen = True
            _extend(bounds, fx * v[i, 0] / zi + cx, fy * v[i, 1] / zi + cy)
        if (zi >= NEAR_M) != (zj >= NEAR_M):
            w = (NEAR_M - zi) / (zj - zi)
            x, y = v[i, 0] + w * (v[j, 0] - v[i, 0]), v[i, 1] + w * (v[j, 1] - v[i, 1])
            _extend(bounds, fx * x / NEAR_M + cx, fy * y / NEAR_M + cy)
    return seen


@njit(cache=True)  # type: ignore[untyped-decorator]
def _extend(bounds: Float64Array, x: float, y: float) -> None:
    bounds[0], bounds[1] = min(bounds[0], x), max(bounds[1], x)
    bounds[2], bounds[3] = min(bounds[2], y), max(bounds[3], y)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _edge_planes(v: Float64Array, fx: float, fy: float, cx: float, cy: float, E: Float64Array) -> float:
    """Edge functions as planes over the image, E[i] = (a, b, c); returns the determinant."""
    for i in range(3):
        p, q = v[(i + 1) % 3], v[(i + 2) % 3]
        ex, ey = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2]
        ez = p[0] * q[1] - p[1] * q[0]
        E[i, 0], E[i, 1] = ex / fx, ey / fy
        E[i, 2] = ez - (E[i, 0] * cx + E[i, 1] * cy)
    p, q = v[1], v[2]
    cross_x, cross_y, cross_z = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    return v[0, 0] * cross_x + v[0, 1] * cross_y + v[0, 2] * cross_z


@njit(cache=True)  # type: ignore[untyped-decorator]
def _fill(
    E: Float64Array, W: Float64Array, bounds: Float64Array, index: int, inv_z: Float64Array, ids: "np.ndarray"
) -> bool:
    """Draw one triangle into the buffers, nearest first; returns whether any pixel was inside its edges."""
    height, width = inv_z.shape
    y0, y1 = max(0, int(np.ceil(bounds[2] - 1e-6))), min(height - 1, int(np.floor(bounds[3] + 1e-6)))
    x0, x1 = max(0, int(np.ceil(bounds[0] - 1e-6))), min(width - 1, int(np.floor(bounds[1] + 1e-6)))
    farthest = 1.0 / NEAR_M
    drawn = False
    for y in range(y0, y1 + 1):
        left, right = x0, x1
        for i in range(3):
            a, rest = E[i, 0], E[i, 1] * y + E[i, 2]
            if a == 0.0:
                if rest < 0.0:
                    right = -1
                continue
            crossing = -rest / a
            if a > 0.0:
                if crossing > left:
                    left = int(np.ceil(crossing)) if crossing <= right else right + 1
            elif crossing < right:
                right = int(np.floor(crossing)) if crossing >= left else left - 1
        if left > right:
            continue
        drawn = True
        row_z, row_id = inv_z[y], ids[y]
        start = W[1] * y + W[2]
        for x in range(left, right + 1):
            value = W[0] * x + start
            if value > row_z[x] and value <= farthest:
                row_z[x] = value
                row_id[x] = index
    return drawn


@njit(cache=True)  # type: ignore[untyped-decorator]
def _attribute_planes(
    E: Float64Array, W: Float64Array, det: float, uv: Float64Array, st: Float64Array, out: Float64Array
) -> None:
    """u/z, v/z, s/z, t/z and 1/z as planes, and the texels a pixel covers at z = 1: the Jacobian is that times z^3."""
    for k in range(3):
        e0, e1, e2 = E[0, k] / det, E[1, k] / det, E[2, k] / det
        out[k] = e0 * uv[0, 0] + e1 * uv[1, 0] + e2 * uv[2, 0]
        out[3 + k] = e0 * uv[0, 1] + e1 * uv[1, 1] + e2 * uv[2, 1]
        out[6 + k] = e0 * st[0, 0] + e1 * st[1, 0] + e2 * st[2, 0]
        out[9 + k] = e0 * st[0, 1] + e1 * st[1, 1] + e2 * st[2, 1]
        out[12 + k] = W[k]
    minor_0 = out[4] * W[2] - out[5] * W[1]
    minor_1 = out[3] * W[2] - out[5] * W[0]
    minor_2 = out[3] * W[1] - out[4] * W[0]
    out[15] = abs(out[0] * minor_0 - out[1] * minor_1 + out[2] * minor_2)


@njit(cache=True)  # type: ignore[untyped-decorator]
def draw(
    points: Float64Array,
    uv: Float64Array,
    st: Float64Array,
    two_sided: "np.ndarray",
    cluster_start: "np.ndarray",
    cluster_sphere: Float64Array,
    M: Float64Array,
    K: Float64Array,
    limits: Float64Array,
    inv_z: Float64Array,
    ids: "np.ndarray",
    planes: Float64Array,
) -> int:
    """Fill `inv_z` [H, W] and `ids` [H, W] (rows of `planes`, -1 where nothing is); returns the rows used.

    Args:
        points: corners of the triangles in the world, m; [F, 3, 3].
        uv: texture coordinates of the corners, texels; [F, 3, 2].
        st: light coordinates of the corners, nodes; [F, 3, 2].
        two_sided: whether the back is drawn; [F].
        cluster_start: first triangle of each cluster, and F; [C + 1].
        cluster_sphere: bounding spheres, centre and radius, m; [C, 4].
        M: world to camera, rotation and translation, m; [3, 4].
        K: camera matrix, px.
        limits: inward unit normals of the four planes that bound the view, in the camera frame; [4, 3].
        inv_z: 1 / depth, 1/m.
        ids: row of `planes` each pixel sees.
        planes: attributes of the drawn triangles; [F, PLANES].
    """
    height, width = inv_z.shape
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    for y in range(height):
        for x in range(width):
            inv_z[y, x] = 0.0
            ids[y, x] = -1
    v, E, W, bounds = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(4)
    count = 0
    for cluster in range(len(cluster_sphere)):
        if not _cluster_is_visible(cluster_sphere[cluster], M, limits):
            continue
        for f in range(cluster_start[cluster], cluster_start[cluster + 1]):
            _camera_corners(points[f], M, v)
            if v[0, 2] < NEAR_M and v[1, 2] < NEAR_M and v[2, 2] < NEAR_M:
                continue
            det = _edge_planes(v, fx, fy, cx, cy, E)
            if det == 0.0 or (det > 0.0 and not two_sided[f]):
                continue  # seen exactly edge on, or from inside a closed solid
            _image_bounds(v, fx, fy, cx, cy, bounds)
            if bounds[1] < 0 or bounds[0] > width - 1 or bounds[3] < 0 or bounds[2] > height - 1:
                continue
            if det < 0.0:
                det = -det
                for i in range(3):
                    for k in range(3):
                        E[i, k] = -E[i, k]
            for k in range(3):
                W[k] = (E[0, k] + E[1, k] + E[2, k]) / det
            if _fill(E, W, bounds, count, inv_z, ids):
                _attribute_planes(E, W, det, uv[f], st[f], planes[count])
                planes[count, 16] = f
                count += 1
    return count


@njit(cache=True)  # type: ignore[untyped-decorator]
def _blend(samples: "np.ndarray", i00: int, i10: int, i01: int, i11: int, fs: int, ft: int, bits: int) -> int:
    """Bilinear mean of four packed samples; fs, ft of `bits` bits. The weights sum to 1 << bits exactly."""
    w11 = (fs * ft) >> bits
    w10, w01 = fs - w11, ft - w11
    w00 = (1 << bits) - fs - ft + w11
    # unsigned indices spare numba's test for counting from the end
    low = samples[np.uintp(i00)] * w00 + samples[np.uintp(i10)] * w10
    return low + samples[np.uintp(i01)] * w01 + samples[np.uintp(i11)] * w11


@njit(cache=True)  # type: ignore[untyped-decorator]
def _level(area: float, size_bits: int) -> int:
    """The level of a texture whose texels are about as large as a pixel that covers `area` texels of the first."""
    level = 0
    while area > 2.0 and level < size_bits:
        area *= 0.25
        level += 1
    return level


@njit(cache=True)  # type: ignore[untyped-decorator]
def _texel(texels: "np.ndarray", offset: int, bits: int, fixed_u: int, fixed_v: int) -> int:
    """Texture colour, 8.8 bits a channel, bilinear on a level of side 1 << bits; u and v in 1/256 of its texels."""
    mask = (1 << bits) - 1
    fixed_u, fixed_v = fixed_u - 128, fixed_v - 128  # texel centres lie at halves
    u0, v0 = (fixed_u >> 8) & mask, (fixed_v >> 8) & mask
    u1, v1 = (u0 + 1) & mask, (v0 + 1) & mask
    row0, row1 = offset + (v0 << bits), offset + (v1 << bits)
    return _blend(texels, row0 + u0, row0 + u1, row1 + u0, row1 + u1, fixed_u & 255, fixed_v & 255, 8)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _light(light: "np.ndarray", offset: int, columns: int, rows: int, s: float, t: float) -> int:
    """Light colour, 10.6 bits a channel, bilinear between the nodes of a patch."""
    fixed_s = min(max(int(s * 64.0), 0), ((columns - 1) << 6) - 1)
    fixed_t = min(max(int(t * 64.0), 0), ((rows - 1) << 6) - 1)
    i = offset + (fixed_t >> 6) * columns + (fixed_s >> 6)
    return _blend(light, i, i + 1, i + columns, i + columns + 1, fixed_s & 63, fixed_t & 63, 6)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _at(planes: Float64Array, row: int, k: int, x: int, y: int, z: float) -> float:
    """Attribute number k / 3 of a drawn triangle at a pixel that sees it at depth z."""
    return (planes[row, k] * x + planes[row, k + 1] * y + planes[row, k + 2]) * z


@njit(cache=True)  # type: ignore[untyped-decorator]
def shade(  # one loop over pixels: the heart of the renderer's speed, not worth cutting up
    inv_z: Float64Array,
    ids: "np.ndarray",
    planes: Float64Array,
    texture: "np.ndarray",
    texels: "np.ndarray",
    level_offsets: "np.ndarray",
    size_bits: "np.ndarray",
    light: "np.ndarray",
    light_patch: "np.ndarray",
    rgb_u8: Uint8Array,
    depth_m: Float32Array,
) -> None:
    """Colour and depth of every pixel from what `draw` left.

    Args:
        inv_z: 1 / depth, 1/m; [H, W].
        ids: row of `planes` each pixel sees; [H, W].
        planes: attributes of the drawn triangles.
        texture: texture layer of each triangle; [F].
        texels: packed samples of all layers and levels.
        level_offsets: first sample of each level of each layer; [L, levels].
        size_bits: binary logarithm of each layer's side; [L].
        light: packed light samples of all patches.
        light_patch: first sample, columns and rows of each triangle's patch; [F, 3].
        rgb_u8: written; black where nothing is; [H, W, 3].
        depth_m: written; along the optical axis, 0 where nothing is, m; [H, W].
    """
    height, width = inv_z.shape
    for y in range(height):
        for x in range(width):
            depth_m[y, x] = 1.0 / inv_z[y, x] if inv_z[y, x] > 0.0 else 0.0
        first = 0
        while first < width:
            row = ids[y, first]
            last, limit = first, min(width, first + SPAN) - 1
            while last < limit and ids[y, last + 1] == row:
                last += 1
            if row < 0:
                for x in range(first, last + 1):
                    rgb_u8[y, x, 0] = rgb_u8[y, x, 1] = rgb_u8[y, x, 2] = 0
                first = last + 1
                continue
            # coordinates and light are exact at both ends of the span, and straight in between
            z0, z1 = depth_m[y, first], depth_m[y, last]
            face = int(planes[row, 16])
            layer = texture[face]
            level = _level(planes[row, 15] * z0 * z1 * max(z0, z1), size_bits[layer])
            offset, bits = level_offsets[layer, level], size_bits[layer] - level
            scale = 65536.0 / (1 << level)
            u0 = _at(planes, row, 0, first, y, z0) * scale
            v0 = _at(planes, row, 3, first, y, z0) * scale
            u1 = _at(planes, row, 0, last, y, z1) * scale
            v1 = _at(planes, row, 3, last, y, z1) * scale
            s0, t0 = _at(planes, row, 6, first, y, z0), _at(planes, row, 9, first, y, z0)
            s1, t1 = _at(planes, row, 6, last, y, z1), _at(planes, row, 9, last, y, z1)
            node, columns, rows = light_patch[face, 0], light_patch[face, 1], light_patch[face, 2]
            # three bits fewer a channel leave room for the weights, which sum to eight
            lit0 = (_light(light, node, columns, rows, s0, t0) >> 3) & LANES_OF_13
            lit1 = (_light(light, node, columns, rows, s1, t1) >> 3) & LANES_OF_13
            part = 1.0 / max(1, last - first)
            u, v, du, dv = int(u0), int(v0), int((u1 - u0) * part), int((v1 - v0) * part)
            weight, growth = 0, int(2048.0 * part)
            for x in range(first, last + 1):
                colour = _texel(texels, offset, bits, u >> 8, v >> 8)
                lit = lit0 * (8 - (weight >> 8)) + lit1 * (weight >> 8)
                for channel in range(3):
                    product = ((colour >> (16 * channel)) & 0xFFFF) * ((lit >> (16 * channel)) & 0xFFFF)
                    rgb_u8[y, x, channel] = min(255, product >> 23)
                u += du
                v += dv
                weight += growth
            first = last + 1
