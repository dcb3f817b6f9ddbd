"""Videos of a furnished box room: colour and exact depth, from a camera that drives and turns. Input for benchmarks.

Every pixel's ray is cut with the room and the boxes in it; surfaces carry fractal textures. The pictures have what
decoders and codecs find hard: edges, texture at all scales, parallax and, through `sensor`, noise.
"""

import numpy as np

WIDTH, HEIGHT = 480, 270
FOCAL_PX = 355.8
ROOM_M = np.array([[0.0, 0.0, 0.0], [6.0, 8.0, 2.6]])
TEXELS_PER_M = 200
TEXTURE_SIDE = 1024


def room_video(seed: int, frames: int, speed_m: float = 0.03, turn_rad: float = 0.012):
    """Return light without noise, float32 [T, 270, 480, 3] in 8-bit levels, and depth_m float32 [T, 270, 480].

    The defaults of speed and turn, per frame, are those of navigation at 30 frames per second: 0.9 m/s, 20 degrees/s.
    """
    rng = np.random.default_rng(seed)
    boxes, colours = _furnish(rng)
    textures = np.stack([_fractal(rng, falloff) for falloff in (0.8, 1.1, 1.4)]).astype(np.float32)
    x, y = np.meshgrid((np.arange(WIDTH) - WIDTH / 2) / FOCAL_PX, (np.arange(HEIGHT) - HEIGHT / 2) / FOCAL_PX)
    position, yaw = np.array([rng.uniform(2.5, 3.5), 0.6, rng.uniform(0.4, 1.3)]), np.pi / 2 + rng.uniform(-0.3, 0.3)
    light = np.empty((frames, HEIGHT, WIDTH, 3), np.float32)
    depth_m = np.empty((frames, HEIGHT, WIDTH), np.float32)
    for t in range(frames):
        ahead, left = np.array([np.cos(yaw), np.sin(yaw), 0]), np.array([-np.sin(yaw), np.cos(yaw), 0])
        rays = (ahead - x[..., None] * left - y[..., None] * np.array([0, 0, 1.0])).astype(np.float32)
        depth_m[t], light[t] = _cast(position.astype(np.float32), rays, boxes, colours, textures)
        position = position + speed_m * ahead
        yaw += turn_rad * np.sin(t / 25 + seed)
    return light, depth_m


def sensor(light, noise_levels: float):
    """Colour video of a camera with Gaussian noise of `noise_levels` 8-bit levels, rgb_u8."""
    noise = np.random.default_rng(0).normal(0, noise_levels, light.shape)
    return np.clip(np.rint(light + noise), 0, 255).astype(np.uint8)


def _furnish(rng):
    """Boxes [N, 2, 3] (lower and upper corner, m), the room first; colours [N, 3, 3] by axis of the face, 0..255."""
    boxes = [ROOM_M]
    for _ in range(9):
        size = rng.uniform([0.2, 0.2, 0.3], [1.2, 1.2, 2.0])
        corner = np.array([rng.choice([rng.uniform(0, 1.2), rng.uniform(3.8, 5)]), rng.uniform(1, 6.5), 0.0])
        boxes.append(np.stack([corner, corner + size]))
    in_the_way = np.array([rng.uniform(2.4, 3.2), rng.uniform(1.8, 2.4), 0.0])  # so that near depth is seen too
    boxes.append(np.stack([in_the_way, in_the_way + rng.uniform([0.3, 0.3, 0.4], [0.9, 0.8, 1.0])]))
    colours = rng.uniform(60, 220, (len(boxes), 1, 3)) * rng.uniform(0.7, 1.0, (len(boxes), 3, 1))
    return np.array(boxes, np.float32), colours.astype(np.float32)


def _fractal(rng, falloff):
    """Periodic noise of spectrum 1 / f^falloff in amplitude, standard deviation 1, float64 [side, side]."""
    f = np.hypot(np.fft.fftfreq(TEXTURE_SIDE)[:, None], np.fft.fftfreq(TEXTURE_SIDE)[None])
    f[0, 0] = np.inf
    noise = np.fft.ifft2(np.fft.fft2(rng.normal(size=f.shape)) / f**falloff).real
    return noise / noise.std()


def _cast(position, rays, boxes, colours, textures):
    """Nearest hit of every ray: depth (the rays have unit length along the optical axis) and colour."""
    with np.errstate(divide="ignore"):
        cuts = (boxes[:, :, None, None] - position) / rays  # [N, 2, H, W, 3]
    near, far = cuts.min(axis=1), cuts.max(axis=1)
    enter, leave = near.max(axis=-1), far.min(axis=-1)
    hit = np.where((enter < leave) & (enter > 0), enter, np.inf)
    hit[0] = leave[0]  # the room is seen from within
    which = hit.argmin(axis=0)
    depth = np.take_along_axis(hit, which[None], 0)[0]
    axis = np.where(
        which == 0, far[0].argmin(axis=-1), np.take_along_axis(near, which[None, ..., None], 0)[0].argmax(-1)
    )
    points = position + depth[..., None] * rays
    u = np.where(axis == 0, points[..., 1], points[..., 0])
    v = np.where(axis == 2, points[..., 1], points[..., 2])
    texel = [(coordinate * TEXELS_PER_M).astype(int) % TEXTURE_SIDE for coordinate in (v, u)]
    texture = textures[which % len(textures), texel[0], texel[1]]
    light = 1.1 - 0.07 * depth
    return depth, (colours[which, axis] + 14 * texture[..., None]) * light[..., None]
