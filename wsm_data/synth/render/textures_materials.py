"""Textures of building materials, furniture and cloth: colours in [0, 1], [size, size, 3], without seams."""

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.render.noise import clouds, coordinates, mix, normalised, smooth_step


def plaster(rng: np.random.Generator, size: int) -> Float64Array:
    """Painted wall: nearly white, to be tinted."""
    value = 0.95 + 0.035 * (clouds(rng, size, 0.6) - 0.5) + 0.04 * (clouds(rng, size, 1.6) - 0.5)
    return np.repeat(value[..., None], 3, axis=-1)


def wood(rng: np.random.Generator, size: int, dark: float = 0.62) -> Float64Array:
    """Grain along u in light grey tones, to be tinted."""
    _, v = coordinates(size)
    warp = clouds(rng, size, 1.8, (6.0, 1.0))
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (v * 7 + 1.6 * warp))
    fine = clouds(rng, size, 0.7, (24.0, 1.0))
    value = dark + (1 - dark) * (0.25 + 0.4 * rings + 0.35 * fine)
    return np.repeat(np.clip(value, 0, 1)[..., None], 3, axis=-1)


def planks(rng: np.random.Generator, size: int, rows: int = 8) -> Float64Array:
    """Boards along u: every row has its own joints, every board its own tone."""
    grain = wood(rng, size)[..., 0]
    u, v = coordinates(size)
    row = np.minimum((v * rows).astype(int), rows - 1)
    shift = rng.random(rows)[row]
    board = ((u + shift) * 2).astype(int) % 2
    tone = 0.82 + 0.18 * rng.random((rows, 2))[row, board]
    seam = _near_line(v * rows, 0.035) | _near_line((u + shift) * 2, 0.006)
    value = grain * tone * np.where(seam, 0.62, 1.0)
    warmth = (rng.random((rows, 2))[row, board] - 0.5)[..., None] * np.array([0.05, 0.0, -0.05])
    return np.clip(value[..., None] + warmth, 0, 1)


def parquet(rng: np.random.Generator, size: int, blocks: int = 4) -> Float64Array:
    """Squares of strips, alternately along u and v."""
    along, across = wood(rng, size)[..., 0], wood(rng, size)[..., 0].T
    u, v = coordinates(size)
    column, row = (u * blocks).astype(int), (v * blocks).astype(int)
    turned = (column + row) % 2 == 1
    strip = np.where(turned, (u * blocks * 4).astype(int), (v * blocks * 4).astype(int))
    tone = 0.8 + 0.2 * rng.random((blocks * 4, blocks * 4))[strip, np.where(turned, row, column)]
    seam = np.where(turned, _near_line(u * blocks * 4, 0.05), _near_line(v * blocks * 4, 0.05))
    seam |= _near_line(u * blocks, 0.012) | _near_line(v * blocks, 0.012)
    value = np.where(turned, across, along) * tone * np.where(seam, 0.68, 1.0)
    return np.repeat(value[..., None], 3, axis=-1)


def tiles(rng: np.random.Generator, size: int, count: int, grout: float, checker: float) -> Float64Array:
    """Square tiles; `grout` is the brightness of the joints, `checker` how much darker every second tile is."""
    u, v = coordinates(size)
    column, row = (u * count).astype(int), (v * count).astype(int)
    tone = 0.9 + 0.1 * rng.random((count, count))[row, column] - checker * ((row + column) % 2)
    cloud = 0.08 * (clouds(rng, size, 1.3) - 0.5)
    joint = _near_line(u * count, 0.022) | _near_line(v * count, 0.022)
    edge = _near_line(u * count, 0.05) | _near_line(v * count, 0.05)
    value = np.where(joint, grout, (tone + cloud) * np.where(edge, 1.05, 1.0))
    return np.repeat(np.clip(value, 0, 1)[..., None], 3, axis=-1)


def brick(rng: np.random.Generator, size: int, rows: int = 8) -> Float64Array:
    """Running bond of red bricks."""
    u, v = coordinates(size)
    row = np.minimum((v * rows).astype(int), rows - 1)
    offset = 0.5 * (row % 2)
    column = ((u * rows / 2 + offset).astype(int)) % (rows // 2)
    tone = rng.random((rows, rows // 2))[row, column]
    joint = _near_line(v * rows, 0.06) | _near_line(u * rows / 2 + offset, 0.03)
    colour = mix((0.56, 0.27, 0.2), (0.78, 0.47, 0.36), np.clip(tone * 0.7 + 0.4 * clouds(rng, size, 0.8) - 0.05, 0, 1))
    return np.where(joint[..., None], np.array([0.78, 0.75, 0.7]), colour)


def carpet(rng: np.random.Generator, size: int) -> Float64Array:
    """Short pile: fine noise with soft patches, to be tinted."""
    value = 0.78 + 0.22 * (0.6 * clouds(rng, size, 0.25) + 0.4 * clouds(rng, size, 1.2))
    return np.repeat(value[..., None], 3, axis=-1)


def fabric(rng: np.random.Generator, size: int, threads: int = 48) -> Float64Array:
    """Plain weave, to be tinted."""
    u, v = coordinates(size)
    weave = 0.5 + 0.25 * np.sin(2 * np.pi * u * threads) * np.cos(2 * np.pi * v * threads)
    value = 0.8 + 0.1 * weave + 0.1 * clouds(rng, size, 0.7)
    return np.repeat(value[..., None], 3, axis=-1)


def leather(rng: np.random.Generator, size: int) -> Float64Array:
    """Creased hide, to be tinted."""
    crease = np.abs(clouds(rng, size, 1.0) - 0.5) * 2
    value = 0.74 + 0.2 * smooth_step(crease, 0.0, 0.35) + 0.06 * clouds(rng, size, 1.8)
    return np.repeat(value[..., None], 3, axis=-1)


def stone(rng: np.random.Generator, size: int) -> Float64Array:
    """Veined stone."""
    vein = 1 - smooth_step(np.abs(clouds(rng, size, 1.5) - 0.5), 0.0, 0.06)
    value = 0.93 - 0.3 * vein * clouds(rng, size, 1.2) - 0.06 * clouds(rng, size, 0.5)
    return np.repeat(value[..., None], 3, axis=-1)


def metal(rng: np.random.Generator, size: int) -> Float64Array:
    """Brushed along u."""
    value = 0.8 + 0.14 * clouds(rng, size, 0.4, (30.0, 1.0)) + 0.05 * clouds(rng, size, 1.8)
    return np.repeat(value[..., None], 3, axis=-1)


def wicker(rng: np.random.Generator, size: int, strands: int = 16) -> Float64Array:
    """Basket weave."""
    u, v = coordinates(size)
    over = ((u * strands).astype(int) + (v * strands).astype(int)) % 2 == 0
    across = np.abs(np.sin(np.pi * np.where(over, v, u) * strands))
    value = 0.45 + 0.5 * across * (0.85 + 0.15 * clouds(rng, size, 0.5))
    return np.repeat(value[..., None], 3, axis=-1)


def stripes(rng: np.random.Generator, size: int, count: int) -> Float64Array:
    """Wallpaper: upright stripes of two tones, to be tinted."""
    u, _ = coordinates(size)
    wide = smooth_step(np.sin(2 * np.pi * u * count), -0.05, 0.05)
    thin = smooth_step(np.cos(2 * np.pi * u * count * 2), 0.93, 0.97)
    value = 0.86 + 0.1 * wide - 0.06 * thin + 0.02 * clouds(rng, size, 0.4)
    return np.repeat(value[..., None], 3, axis=-1)


def ornament(rng: np.random.Generator, size: int) -> Float64Array:
    """Wallpaper: mirrored foliage, to be tinted."""
    u, v = coordinates(size)
    figure = np.zeros((size, size))
    for cell_u, cell_v in ((0.0, 0.0), (0.5, 0.5)):
        x, y = (u - cell_u + 0.25) % 1.0 - 0.5, (v - cell_v + 0.25) % 1.0 - 0.5
        radius, angle = np.hypot(x * 1.5, y), np.arctan2(np.abs(x) * 1.5, -y)
        petal = 0.13 + 0.09 * np.cos(5 * angle) + 0.03 * np.cos(9 * angle)
        figure = np.maximum(figure, smooth_step(petal - radius, 0.0, 0.015))
        figure = np.maximum(figure, smooth_step(0.02 - np.abs(radius - 0.27 - 0.02 * np.cos(7 * angle)), 0.0, 0.012))
    value = 0.95 - 0.11 * figure + 0.02 * (clouds(rng, size, 0.4) - 0.5)
    return np.repeat(value[..., None], 3, axis=-1)


def dots(rng: np.random.Generator, size: int, count: int = 4) -> Float64Array:
    """Wallpaper: small diamonds in rows, to be tinted."""
    u, v = coordinates(size)
    row = (v * count * 2).astype(int)
    x, y = (u * count + 0.5 * (row % 2)) % 1.0 - 0.5, (v * count * 2) % 1.0 - 0.5
    diamond = smooth_step(0.17 - (np.abs(x) + np.abs(y) * 0.6), 0.0, 0.03)
    value = 0.95 - 0.13 * diamond + 0.02 * (clouds(rng, size, 0.4) - 0.5)
    return np.repeat(value[..., None], 3, axis=-1)


def leaf(rng: np.random.Generator, size: int) -> Float64Array:
    """A leaf's blade, stem along v."""
    u, v = coordinates(size)
    side = np.abs(u - 0.5)
    veins = np.abs(((v * 9 + side * 6) % 1.0) - 0.5) < 0.06
    value = 0.72 + 0.28 * clouds(rng, size, 1.0) - 0.1 * veins + 0.15 * (side < 0.02)
    return np.clip(mix((0.12, 0.3, 0.1), (0.36, 0.6, 0.22), normalised(value)), 0, 1)


def bark(rng: np.random.Generator, size: int) -> Float64Array:
    """Bark and soil."""
    return mix((0.24, 0.17, 0.12), (0.5, 0.38, 0.28), clouds(rng, size, 0.6, (1.0, 3.0)))


def duvet(rng: np.random.Generator, size: int) -> Float64Array:
    """Bedding with soft folds, to be tinted."""
    fold = np.abs(clouds(rng, size, 2.2, (1.0, 1.6)) - 0.5) * 2
    value = 0.9 + 0.07 * smooth_step(fold, 0.0, 0.8) + 0.03 * clouds(rng, size, 0.3)
    return np.repeat(np.clip(value, 0, 1)[..., None], 3, axis=-1)


def _near_line(value: Float64Array, width: float) -> "np.ndarray":
    """Whether a value is within `width` of a whole number."""
    part = value % 1.0
    return (part < width) | (part > 1 - width)
