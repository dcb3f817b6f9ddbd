"""Textures that are pictures: views from the window, paintings, rugs, books, screens; [size, size, 3] in [0, 1]."""

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.render.noise import clouds, coordinates, mix, smooth_step

Palette = list[tuple[float, float, float]]

_PALETTES: list[Palette] = [
    [(0.93, 0.89, 0.8), (0.8, 0.33, 0.22), (0.16, 0.3, 0.4), (0.9, 0.68, 0.3), (0.35, 0.5, 0.47)],
    [(0.95, 0.93, 0.9), (0.23, 0.35, 0.55), (0.85, 0.55, 0.5), (0.55, 0.67, 0.72), (0.2, 0.2, 0.25)],
    [(0.9, 0.86, 0.76), (0.42, 0.5, 0.3), (0.75, 0.5, 0.25), (0.28, 0.22, 0.2), (0.85, 0.75, 0.55)],
    [(0.94, 0.9, 0.88), (0.6, 0.25, 0.4), (0.3, 0.25, 0.5), (0.93, 0.7, 0.55), (0.35, 0.55, 0.6)],
    [(0.96, 0.94, 0.86), (0.1, 0.45, 0.5), (0.95, 0.5, 0.25), (0.15, 0.2, 0.35), (0.7, 0.8, 0.7)],
]


def pick_palette(rng: np.random.Generator) -> Palette:
    """Five colours that go together: a pale ground and four others."""
    return _PALETTES[int(rng.integers(len(_PALETTES)))]


def garden_view(rng: np.random.Generator, size: int) -> Float64Array:
    """Sky, trees, a lawn."""
    _, v = coordinates(size)
    sky = mix((0.55, 0.75, 0.97), (0.93, 0.97, 1.0), np.clip(v * 1.6, 0, 1))
    sky = sky + (1 - sky) * 0.8 * smooth_step(clouds(rng, size, 1.6, (0.5, 1.0)), 0.55, 0.9)[..., None]
    picture = sky
    for depth, base in enumerate((0.5, 0.58, 0.66)):
        crown = base - 0.16 * (clouds(rng, size, 1.5)[size // 2][None, :] - 0.3)
        trees = mix((0.2, 0.36, 0.16), (0.5, 0.66, 0.34), clouds(rng, size, 0.8)) * (1.12 - 0.13 * depth)
        picture = np.where((v > crown)[..., None], trees, picture)
    lawn = mix((0.36, 0.55, 0.22), (0.56, 0.72, 0.32), clouds(rng, size, 0.6, (2.0, 1.0)))
    return np.where((v > 0.76)[..., None], lawn, picture)


def town_view(rng: np.random.Generator, size: int) -> Float64Array:
    """Sky over the fronts of houses."""
    u, v = coordinates(size)
    picture = mix((0.5, 0.68, 0.93), (0.97, 0.94, 0.88), np.clip(v * 1.5, 0, 1))
    start = 0.0
    while start < 1.0:
        width, roof = rng.uniform(0.14, 0.3), rng.uniform(0.25, 0.6)
        colour = np.array([0.82, 0.74, 0.62]) * rng.uniform(0.7, 1.1) + rng.uniform(-0.08, 0.08, 3)
        inside = (u >= start) & (u < start + width) & (v > roof)
        x, y = ((u - start) / 0.055) % 1.0, ((v - roof) / 0.08) % 1.0
        window = (np.abs(x - 0.5) < 0.25) & (np.abs(y - 0.55) < 0.28)
        front = np.where(window[..., None], np.array([0.28, 0.34, 0.42]), np.clip(colour, 0, 1))
        picture = np.where(inside[..., None], front, picture)
        start += width
    return np.clip(picture + 0.03 * (clouds(rng, size, 0.5) - 0.5)[..., None], 0, 1)


def hills(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: ridge behind ridge in the haze."""
    _, v = coordinates(size)
    ground, *tones = pick_palette(rng)
    picture = mix(ground, tones[2], smooth_step(v, 0.1, 0.6) * 0.6)
    for i in range(5):
        ridge = 0.35 + 0.12 * i + 0.16 * (clouds(rng, size, 1.7)[0][None, :] - 0.5)
        shade = np.array(tones[i % len(tones)]) * (1 - 0.12 * i)
        picture = np.where((v > ridge)[..., None], shade, picture)
    return _brushed(rng, picture)


def sea(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: sun over water."""
    u, v = coordinates(size)
    sky = mix((0.98, 0.72, 0.42), (0.5, 0.62, 0.8), 1 - smooth_step(v, 0.0, 0.55))
    waves = clouds(rng, size, 1.0, (0.4, 4.0))
    water = mix((0.1, 0.24, 0.4), (0.42, 0.6, 0.68), waves)
    glitter = (np.abs(u - 0.6) < 0.06 + 0.12 * (v - 0.55)) & (waves > 0.55)
    picture = np.where((v > 0.55)[..., None], np.where(glitter[..., None], (1.0, 0.85, 0.6), water), sky)
    sun = np.hypot(u - 0.6, v - 0.42) < 0.08
    return _brushed(rng, np.where(sun[..., None] & (v < 0.55)[..., None], (1.0, 0.93, 0.75), picture))


def circles(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: overlapping discs."""
    u, v = coordinates(size)
    palette = pick_palette(rng)
    picture = np.tile(np.array(palette[0]), (size, size, 1))
    for i in range(11):
        x, y, radius = rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.9), rng.uniform(0.06, 0.26)
        inside = smooth_step(radius - np.hypot(u - x, v - y), 0.0, 0.01)[..., None]
        picture = picture + (np.array(palette[1 + i % 4]) - picture) * inside * 0.88
    return _brushed(rng, picture)


def blocks(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: coloured fields between dark lines."""
    u, v = coordinates(size)
    palette = pick_palette(rng)
    columns, rows = np.sort(rng.uniform(0.1, 0.9, 3)), np.sort(rng.uniform(0.1, 0.9, 3))
    column, row = np.searchsorted(columns, u), np.searchsorted(rows, v)
    chosen = rng.choice(5, (4, 4), p=[0.44, 0.16, 0.14, 0.14, 0.12])[row, column]
    line = (np.abs(u[..., None] - columns).min(-1) < 0.012) | (np.abs(v[..., None] - rows).min(-1) < 0.012)
    return _brushed(rng, np.where(line[..., None], 0.12, np.array(palette)[chosen]))


def strokes(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: broad crossing strokes."""
    palette = pick_palette(rng)
    picture = np.tile(np.array(palette[0]), (size, size, 1))
    u, v = coordinates(size)
    for i in range(14):
        angle, offset, width = rng.uniform(0, np.pi), rng.uniform(-0.5, 0.5), rng.uniform(0.02, 0.09)
        across = (u - 0.5) * np.cos(angle) + (v - 0.5) * np.sin(angle) - offset
        across = across + 0.06 * (clouds(rng, size, 1.8) - 0.5)
        body = smooth_step(width - np.abs(across), 0.0, 0.02)[..., None]
        picture = picture + (np.array(palette[1 + i % 4]) - picture) * body * 0.85
    return _brushed(rng, picture)


def flower(rng: np.random.Generator, size: int) -> Float64Array:
    """Painting: one large blossom."""
    u, v = coordinates(size)
    palette = pick_palette(rng)
    radius, angle = np.hypot(u - 0.5, v - 0.42), np.arctan2(v - 0.42, u - 0.5)
    picture = mix(palette[0], palette[4], 0.4 * clouds(rng, size, 1.5))
    stem = (np.abs(u - 0.5 - 0.05 * np.sin(v * 5)) < 0.012) & (v > 0.45)
    picture = np.where(stem[..., None], (0.25, 0.42, 0.2), picture)
    for reach, colour in ((0.33, palette[1]), (0.24, palette[3]), (0.13, palette[2])):
        petals = smooth_step(reach * (0.75 + 0.25 * np.cos(7 * angle + 9 * reach)) - radius, 0.0, 0.015)[..., None]
        picture = picture + (np.array(colour) - picture) * petals
    return _brushed(rng, picture)


def rug_border(rng: np.random.Generator, size: int) -> Float64Array:
    """Rug: frames around a medallion."""
    u, v = coordinates(size)
    palette = pick_palette(rng)
    inset = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
    picture = np.tile(np.array(palette[1]), (size, size, 1))
    for start, colour in ((0.04, 0), (0.06, 2), (0.13, 0), (0.15, 1)):
        picture = np.where((inset > start)[..., None], palette[colour], picture)
    angle, radius = np.arctan2(v - 0.5, u - 0.5), np.hypot(u - 0.5, v - 0.5)
    for reach, colour in ((0.28, 3), (0.22, 2), (0.12, 0)):
        star = radius < reach * (0.85 + 0.15 * np.cos(8 * angle))
        picture = np.where(star[..., None], palette[colour], picture)
    small = (np.sin(u * 60) * np.sin(v * 60) > 0.72) & (inset > 0.07) & (inset < 0.12)
    return _piled(rng, np.where(small[..., None], palette[0], picture))


def rug_geometric(rng: np.random.Generator, size: int) -> Float64Array:
    """Rug: a lattice of diamonds."""
    u, v = coordinates(size)
    palette = pick_palette(rng)
    diamond = np.abs((u * 5) % 1.0 - 0.5) + np.abs((v * 5) % 1.0 - 0.5)
    band = (diamond * 6).astype(int)
    return _piled(rng, np.array(palette)[np.array([1, 0, 3, 0, 2, 0, 0])[np.clip(band, 0, 6)]])


def rug_striped(rng: np.random.Generator, size: int) -> Float64Array:
    """Rug: stripes of many widths."""
    _, v = coordinates(size)
    palette = np.array(pick_palette(rng))
    edges = np.sort(rng.random(18))
    return _piled(rng, palette[rng.integers(0, 5, 19)[np.searchsorted(edges, v)]])


def book(rng: np.random.Generator, size: int) -> Float64Array:
    """Back of a book, to be tinted."""
    u, v = coordinates(size)
    round_back = 0.72 + 0.28 * np.sin(np.pi * u)
    band = ((np.abs(v - 0.14) < 0.02) | (np.abs(v - 0.86) < 0.02)) * 0.35
    title = ((np.abs(u - 0.5) < 0.16) & (v > 0.3) & (v < 0.68) & (np.sin(v * 90) > -0.2)) * 0.4
    value = np.clip(0.82 * round_back + band + title, 0, 1) + 0.03 * (clouds(rng, size, 0.4) - 0.5)
    return np.repeat(np.clip(value, 0, 1)[..., None], 3, axis=-1)


def screen(rng: np.random.Generator, size: int) -> Float64Array:
    """A dark screen with a sheen and a frame."""
    u, v = coordinates(size)
    sheen = 0.05 + 0.16 * smooth_step(u - v * 0.7, 0.1, 0.6) * (1 - smooth_step(u - v * 0.7, 0.6, 0.64))
    frame = np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v)) < 0.018
    value = np.where(frame, 0.04, sheen)[..., None] * np.array([0.9, 1.0, 1.15])
    return np.clip(value + 0.01 * clouds(rng, size, 1.0)[..., None], 0, 1)


def mirror(rng: np.random.Generator, size: int) -> Float64Array:
    """Silvered glass: a pale, blurred room that is not there."""
    _, v = coordinates(size)
    value = 0.62 + 0.28 * clouds(rng, size, 2.2) - 0.1 * v
    return np.clip(value[..., None] * np.array([0.93, 0.98, 1.0]), 0, 1)


def _brushed(rng: np.random.Generator, picture: Float64Array) -> Float64Array:
    """Paint on canvas instead of flat colour."""
    size = picture.shape[0]
    return np.clip(picture + 0.09 * (clouds(rng, size, 0.7, (3.0, 1.0)) - 0.5)[..., None], 0, 1)


def _piled(rng: np.random.Generator, picture: Float64Array) -> Float64Array:
    """Wool instead of flat colour."""
    size = picture.shape[0]
    return np.clip(picture * (0.84 + 0.2 * clouds(rng, size, 0.3)[..., None]), 0, 1)
