"""What is planted in trajectories: faults that must be found, and harmless oddities that must not be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.point_cloud import PointCloud


@dataclass(frozen=True, kw_only=True)
class Episode:
    """A trajectory as it was read, decoded; rgb_u8 [T, H, W, 3], raw_u16 [T, H, W]."""

    record: EpisodeRecord
    rgb: np.ndarray
    raw: np.ndarray
    cloud: PointCloud

    @property
    def poses(self) -> np.ndarray:
        return np.array(self.record.T_world_camera)

    def with_poses(self, T_world_camera: np.ndarray) -> "Episode":
        return replace(self, record=replace(self.record, T_world_camera=T_world_camera))

    def with_metres(self, change: Callable[[np.ndarray], np.ndarray]) -> "Episode":
        """Depth changed in metres and stored again."""
        raw = np.rint(change(self.raw * 1e-4) / 1e-4).clip(0, 65534).astype(np.uint16)
        return replace(self, raw=np.where(self.raw == 0, 0, raw))


def cut(record: EpisodeRecord, frames: slice) -> EpisodeRecord:
    return replace(
        record,
        T_world_camera=record.T_world_camera[frames],
        rgb_members=record.rgb_members[frames],
        depth_members=record.depth_members[frames],
    )


# What is planted: a function of the trajectory, another one of another home, and random numbers.

Planter = Callable[[Episode, Episode, np.random.Generator], Episode]


def posed(change: Callable[[np.ndarray], np.ndarray]) -> Planter:
    return lambda one, _other, _rng: one.with_poses(change(one.poses))


def coloured(change: Callable[[np.ndarray], np.ndarray]) -> Planter:
    return lambda one, _other, _rng: replace(one, rgb=np.ascontiguousarray(change(one.rgb)))


def coded(change: Callable[[np.ndarray], np.ndarray]) -> Planter:
    return lambda one, _other, _rng: replace(one, raw=np.ascontiguousarray(change(one.raw)))


def measured(change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Planter:
    return lambda one, _other, rng: one.with_metres(lambda depth_m: change(depth_m, rng))


def pointed(change: Callable[[np.ndarray], np.ndarray]) -> Planter:
    def plant(one, _other, _rng):
        xyz = change(one.cloud.xyz_m.astype(np.float64)).astype(np.float32)
        return replace(one, cloud=replace(one.cloud, xyz_m=xyz))

    return plant


def yaw(T: np.ndarray, deg: float, frames: slice = slice(None)) -> np.ndarray:
    """Cameras turned about the vertical where they stand."""
    c, s = np.cos(np.deg2rad(deg)), np.sin(np.deg2rad(deg))
    T[frames, :3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ T[frames, :3, :3]
    return T


def moved(T: np.ndarray, by_m: Sequence[float], frames: slice = slice(None)) -> np.ndarray:
    T[frames, :3, 3] += np.array(by_m)
    return T


def scaled(T: np.ndarray, factor: float) -> np.ndarray:
    T[:, :2, 3] = T[0, :2, 3] + factor * (T[:, :2, 3] - T[0, :2, 3])
    return T


def stuck(T: np.ndarray, frames: slice) -> np.ndarray:
    T[frames] = T[frames][0]
    return T


def late(values: np.ndarray, frames: int) -> np.ndarray:
    """The value of every frame is that of some frames before."""
    return values[np.clip(np.arange(len(values)) - frames, 0, len(values) - 1)]


def with_frames(values: np.ndarray, frames: Sequence[int], new: np.ndarray) -> np.ndarray:
    values = values.copy()
    values[list(frames)] = new
    return values


def exchanged(values: np.ndarray, a: int, b: int) -> np.ndarray:
    values = values.copy()
    values[[a, b]] = values[[b, a]]
    return values


def shuffled(values: np.ndarray) -> np.ndarray:
    return values[np.random.default_rng(0).permutation(len(values))]


def mounted(height: Callable[[float], float] = lambda h: h, pitch_deg: float = 0.0) -> Planter:
    def plant(one, _other, _rng):
        record = one.record
        mount = {
            "camera_height_m": height(record.camera_height_m),
            "camera_pitch_rad": record.camera_pitch_rad + np.deg2rad(pitch_deg),
        }
        return replace(one, record=replace(record, **mount))

    return plant


def camera(**factors: float) -> Planter:
    def plant(one, _other, _rng):
        K = one.record.intrinsics
        values = {name: factor * getattr(K, name) for name, factor in factors.items()}
        return replace(one, record=replace(one.record, intrinsics=replace(K, **values)))

    return plant


def goal_in_wall(one: Episode, _other: Episode, _rng: np.random.Generator) -> Episode:
    """The last five positions lead straight into the nearest thing that is tall, and 0.2 m beyond its surface."""
    T = one.poses
    tall = one.cloud.xyz_m[(one.cloud.xyz_m[:, 2] > one.record.floor_z_m + 0.2)]
    tall = tall[tall[:, 2] < one.record.floor_z_m + one.record.camera_height_m][:, :2].astype(np.float64)
    end = T[-6, :2, 3]
    nearest = tall[np.argmin(np.linalg.norm(tall - end, axis=1))]
    beyond = nearest + 0.2 * (nearest - end) / np.linalg.norm(nearest - end)
    T[-5:, :2, 3] = end + np.linspace(0.2, 1, 5)[:, None] * (beyond - end)
    return one.with_poses(T)


def wall_across(one: Episode, _other: Episode, _rng: np.random.Generator) -> Episode:
    """A wall of points across the middle of the way, that no image shows."""
    at = one.poses[len(one.rgb) // 2, :3, 3]
    y, z = (axis.ravel() for axis in np.meshgrid(np.arange(-0.6, 0.6, 0.03), np.arange(0.0, 1.0, 0.03)))
    ahead = one.poses[len(one.rgb) // 2, :3, 2]
    aside = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead[:2])
    wall = np.column_stack([at[:2] + y[:, None] * aside, one.record.floor_z_m + z]).astype(np.float32)
    rgb = np.broadcast_to(np.uint8([0, 0, 128]), wall.shape)
    return with_points(one, wall, rgb)


def with_points(one: Episode, xyz: np.ndarray, rgb: np.ndarray) -> Episode:
    cloud = one.cloud
    return replace(
        one,
        cloud=PointCloud(
            xyz_m=np.concatenate([cloud.xyz_m, xyz]), rgb_u8=np.concatenate([cloud.rgb_u8, rgb]).astype(np.uint8)
        ),
    )


def part_of_cloud(share: float) -> Planter:
    def plant(one, _other, rng):
        kept = rng.random(len(one.cloud.xyz_m)) < share
        return replace(one, cloud=PointCloud(xyz_m=one.cloud.xyz_m[kept], rgb_u8=one.cloud.rgb_u8[kept]))

    return plant


def kinect(one: Episode, _other: Episode, rng: np.random.Generator) -> Episode:
    """Noise of 0.0012 + 0.0019 (z - 0.4)^2 m (Nguyen, Izadi, Lovell 2012), holes at edges, jitter of 1 cm, 0.5 deg."""
    metres = one.raw * 1e-4
    noisy = metres + rng.normal(size=metres.shape) * (0.0012 + 0.0019 * (metres - 0.4) ** 2)
    steep = np.abs(np.diff(metres, axis=2, append=metres[:, :, -1:])) > 0.1 * np.maximum(metres, 0.1)
    holes = np.stack([cv2.dilate(frame.astype(np.uint8), np.ones((5, 5), np.uint8)) for frame in steep]) > 0
    raw = np.where(holes, 0, np.rint(noisy / 1e-3) * 10).clip(0, 65534).astype(np.uint16)
    return jittered(replace(one, raw=raw), 0.01, 0.5, rng)


def jittered(one: Episode, metres: float, deg: float, rng: np.random.Generator) -> Episode:
    T = one.poses
    for t in range(len(T)):
        T[t, :3, :3] = T[t, :3, :3] @ cv2.Rodrigues(np.deg2rad(deg) / np.sqrt(3) * rng.normal(size=3))[0]
        T[t, :3, 3] += metres / np.sqrt(3) * rng.normal(size=3)
    return one.with_poses(T)


FLIP_Y = np.array([1.0, -1.0, 1.0])
MIDDLE = slice(25, 40)

FAULTS: dict[str, Planter] = {
    "cloud: of another home": lambda one, other, _rng: replace(one, cloud=other.cloud),
    "cloud: moved 0.3 m": pointed(lambda p: p + np.array([0.3, 0, 0])),
    "cloud: moved 3 m": pointed(lambda p: p + np.array([3, 0, 0])),
    "cloud: moved 50 m": pointed(lambda p: p + np.array([50, 0, 0])),
    "cloud: lifted 0.1 m": pointed(lambda p: p + np.array([0, 0, 0.1])),
    "cloud: turned 90 degrees": pointed(lambda p: p @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])),
    "cloud: turned 5 degrees": pointed(lambda p: yaw(np.eye(4)[None], 5)[0, :3, :3].dot(p.T).T),
    "cloud: mirrored": pointed(lambda p: p * FLIP_Y),
    "cloud: y up": pointed(lambda p: p[:, [0, 2, 1]] * FLIP_Y),
    "cloud: a tenth of its size": pointed(lambda p: 0.1 * p),
    "cloud: in centimetres": pointed(lambda p: 100 * p),
    "cloud: a random tenth of the points": part_of_cloud(0.1),
    "poses: stuck": posed(lambda T: stuck(T, slice(None))),
    "poses: stuck from the middle on": posed(lambda T: stuck(T, slice(30, None))),
    "poses: stuck for 15 frames": posed(lambda T: stuck(T, MIDDLE)),
    "poses: in centimetres": posed(lambda T: scaled(T, 100)),
    "poses: 1.2 times as far": posed(lambda T: scaled(T, 1.2)),
    "poses: half as far": posed(lambda T: scaled(T, 0.5)),
    "poses: 5 degrees of yaw off": posed(lambda T: yaw(T, 5)),
    "poses: 2 degrees of yaw off": posed(lambda T: yaw(T, 2)),
    "poses: 180 degrees of yaw off": posed(lambda T: yaw(T, 180)),
    "poses: one jump of 0.4 m, kept": posed(lambda T: moved(T, [0.4, 0, 0], slice(30, None))),
    "poses: one pose 0.4 m off": posed(lambda T: moved(T, [0.4, 0, 0], slice(30, 31))),
    "poses: one jump of 50 degrees, kept": posed(lambda T: yaw(T, 50, slice(30, None))),
    "poses: 1 m higher": posed(lambda T: moved(T, [0, 0, 1])),
    "poses: 0.1 m higher": posed(lambda T: moved(T, [0, 0, 0.1])),
    "poses: 1 frame late": posed(lambda T: late(T, 1)),
    "poses: 5 frames late": posed(lambda T: late(T, 5)),
    "poses: reversed": posed(lambda T: T[::-1].copy()),
    "poses: mirrored": posed(lambda T: np.diag([1.0, -1, 1, 1]) @ T @ np.diag([-1.0, 1, 1, 1])),
    "poses: of another trajectory": lambda one, other, _rng: one.with_poses(other.poses[: len(one.rgb)]),
    "poses: inverted": posed(np.linalg.inv),
    "colour: black": coloured(lambda v: 0 * v),
    "colour: white": coloured(lambda v: 0 * v + 255),
    "colour: noise": lambda one, _o, rng: replace(one, rgb=rng.integers(0, 256, one.rgb.shape).astype(np.uint8)),
    "colour: frozen": coloured(lambda v: with_frames(v, range(len(v)), v[0])),
    "colour: frozen from the middle on": coloured(lambda v: with_frames(v, range(30, len(v)), v[30])),
    "colour: one frame twice": coloured(lambda v: with_frames(v, [31], v[30])),
    "colour: shuffled": coloured(shuffled),
    "colour: reversed": coloured(lambda v: v[::-1]),
    "colour: red and blue exchanged": coloured(lambda v: v[..., ::-1]),
    "colour: mirrored": coloured(lambda v: v[:, :, ::-1]),
    "colour: upside down": coloured(lambda v: v[:, ::-1]),
    "colour: negative": coloured(lambda v: 255 - v),
    "colour: 3 frames late": coloured(lambda v: late(v, 3)),
    "colour: 5 frames late": coloured(lambda v: late(v, 5)),
    "colour: of another home": lambda one, other, _rng: replace(one, rgb=other.rgb[: len(one.rgb)]),
    "colour: one frame of another home": lambda one, other, _rng: replace(
        one, rgb=with_frames(one.rgb, [30], other.rgb[30])
    ),
    "colour: five frames of another home": lambda one, other, _rng: replace(
        one, rgb=with_frames(one.rgb, range(30, 35), other.rgb[30:35])
    ),
    "colour: one black frame": coloured(lambda v: with_frames(v, [30], np.zeros_like(v[0]))),
    "colour: one white frame": coloured(lambda v: with_frames(v, [30], np.full_like(v[0], 255))),
    "colour: frames 15 and 45 exchanged": coloured(lambda v: exchanged(v, 15, 45)),
    "colour: two neighbours exchanged": coloured(lambda v: exchanged(v, 30, 31)),
    "depth: x 1.1": measured(lambda d, _rng: 1.1 * d),
    "depth: x 1.03": measured(lambda d, _rng: 1.03 * d),
    "depth: x 0.5": measured(lambda d, _rng: 0.5 * d),
    "depth: in millimetres": coded(lambda v: (v // 10).astype(np.uint16)),
    "depth: along the ray": lambda one, _o, _rng: one.with_metres(lambda d: d * ray_lengths(one.record)),
    "depth: 8 bits in 16": coded(lambda v: (v >> 8 << 8).astype(np.uint16)),
    "depth: 8 bits over 5 m": measured(lambda d, _rng: np.rint(d.clip(0, 5) / 5 * 255) * 5 / 255),
    "depth: 95 % lost": lambda one, _o, rng: replace(one, raw=np.where(rng.random(one.raw.shape) < 0.95, 0, one.raw)),
    "depth: noise of 10 %": measured(lambda d, rng: d * (1 + 0.1 * rng.normal(size=d.shape))),
    "depth: bytes swapped": coded(lambda v: v.byteswap()),
    "depth: upside down": coded(lambda v: v[:, ::-1]),
    "depth: mirrored": coded(lambda v: v[:, :, ::-1]),
    "depth: frozen": coded(lambda v: with_frames(v, range(len(v)), v[0])),
    "depth: frozen from the middle on": coded(lambda v: with_frames(v, range(30, len(v)), v[30])),
    "depth: shuffled": coded(shuffled),
    "depth: 1 frame late": coded(lambda v: late(v, 1)),
    "depth: 3 frames late": coded(lambda v: late(v, 3)),
    "depth: of another home": lambda one, other, _rng: replace(one, raw=other.raw[: len(one.raw)]),
    "depth: one frame of another home": lambda one, other, _rng: replace(
        one, raw=with_frames(one.raw, [30], other.raw[30])
    ),
    "mount: height + 0.1 m": mounted(lambda h: h + 0.1),
    "mount: height halved": mounted(lambda h: h / 2),
    "mount: pitch + 5 degrees": mounted(pitch_deg=5),
    "camera: fx, fy + 10 %": camera(fx=1.1, fy=1.1),
    "camera: fx + 2 %": camera(fx=1.02),
    "camera: cx + 5 %": camera(cx=1.05),
    "path: goal inside a thing": goal_in_wall,
    "path: through a wall": wall_across,
}

HARMLESS: dict[str, Planter] = {
    "colour: half as bright": coloured(lambda v: v // 2),
    "colour: brightness swings by 30 %": coloured(
        lambda v: (v * (0.85 + 0.15 * np.sin(np.arange(len(v)) / 3))[:, None, None, None]).astype(np.uint8)
    ),
    "colour: noise of 8 levels": lambda one, _o, rng: replace(
        one, rgb=(one.rgb + 8 * rng.normal(size=one.rgb.shape)).clip(0, 255).astype(np.uint8)
    ),
    "colour: grey camera": coloured(lambda v: np.repeat(v.mean(axis=-1, keepdims=True).astype(np.uint8), 3, axis=-1)),
    "depth: noise of 1 %": measured(lambda d, rng: d * (1 + 0.01 * rng.normal(size=d.shape))),
    "depth: steps of 1 mm": measured(lambda d, _rng: np.rint(d / 1e-3) * 1e-3),
    "depth: x 1.005": measured(lambda d, _rng: 1.005 * d),
    "depth: half of the pixels lost": lambda one, _o, rng: replace(
        one, raw=np.where(rng.random(one.raw.shape) < 0.5, 0, one.raw)
    ),
    "depth: nothing beyond 4 m": measured(lambda d, _rng: np.where(d > 4, 0, d)),
    "poses: jitter of 2 mm, 0.1 degrees": lambda one, _o, rng: jittered(one, 0.002, 0.1, rng),
    "poses: every second frame": lambda one, _o, _rng: replace(
        one, record=cut(one.record, slice(None, None, 2)), rgb=one.rgb[::2], raw=one.raw[::2]
    ),
    "mount: height + 1 cm": mounted(lambda h: h + 0.01),
    "cloud: half of the points": part_of_cloud(0.5),
    "cloud: 5 cm to the side": pointed(lambda p: p + np.array([0.05, 0, 0])),
    "a Kinect's noise, poses off by 1 cm and 0.5 degrees": kinect,
}


def ray_lengths(record: EpisodeRecord) -> np.ndarray:
    return np.linalg.norm(pixel_rays(record.intrinsics), axis=-1)
