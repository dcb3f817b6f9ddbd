"""How often sound windows of a noisy camera are refused for their motion, and how often a slip of one frame is found.

Windows of a furnished room whose depth is known in closed form, by a camera in a hand at 30 Hz and one on a robot that
turns, or drives straight ahead at constant speed: there all offsets fit alike, but for the noise. Depth has a Kinect's
noise, 0.0012 + 0.0019 (z - 0.4)^2 m (Nguyen, Izadi and Lovell 2012), steps of 1 mm, holes where it is steep, and poses
jitter by 1 cm and 0.5 degrees. Each window is checked as it is, with depth one frame late, and with one image missing
in the middle. What was found is written after every 10 windows. Run as `python bench/sensor_noise.py`.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import cv2
import numpy as np
from generated_room import _cast, _furnish
from reporting import machine, machine_line, table, write_results

from wsm_data.checks.depth_agreement import check_depth_agreement
from wsm_data.checks.depth_motion import check_depth_motion
from wsm_data.checks.images.time_offset import check_time_offset
from wsm_data.clips.depth_gate import chained_steps, spread_pairs
from wsm_data.codecs.depth import normalise_depth
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

WINDOWS = 500
FRAMES = 60
K = Intrinsics(fx=118.6, fy=118.6, cx=79.5, cy=44.5, width=160, height=90)


@dataclass(frozen=True, kw_only=True)
class Carried:
    """How a camera moves between frames: metres, degrees, how much its speed swings, and its manifest's limit."""

    step_m: float
    turn_deg: float
    swing: float = 0.3
    max_error: float


CARRIED = {
    "hand, 30 Hz": Carried(step_m=0.012, turn_deg=0.7, max_error=0.05),
    "robot, 5 cm a frame": Carried(step_m=0.05, turn_deg=1.0, max_error=0.02),
    "robot, straight": Carried(step_m=0.05, turn_deg=0.0, swing=0.0, max_error=0.02),
}
KINDS = tuple(f"{noise} {what}" for noise in ("exact", "noisy") for what in ("sound", "slip", "gap"))
WRITTEN_EVERY = 10


def window(seed: int, carried: Carried) -> tuple[np.ndarray, np.ndarray]:
    """True poses [T, 4, 4] and depth [T, H, W] of a way that turns one way and then the other."""
    rng = np.random.default_rng(seed)
    boxes, colours = _furnish(rng)
    textures = np.stack([_fractal_of_nothing()] * 3)
    u, v = np.meshgrid((np.arange(K.width) - K.cx) / K.fx, (np.arange(K.height) - K.cy) / K.fy)
    position, yaw = np.array([rng.uniform(2.5, 3.5), 0.6, rng.uniform(0.6, 1.3)]), np.pi / 2 + rng.uniform(-0.3, 0.3)
    phase = rng.uniform(0, 2 * np.pi)
    T, depth = np.tile(np.eye(4), (FRAMES, 1, 1)), np.empty((FRAMES, K.height, K.width), np.float32)
    for t in range(FRAMES):
        ahead, right = np.array([np.cos(yaw), np.sin(yaw), 0]), np.array([np.sin(yaw), -np.cos(yaw), 0])
        T[t, :3, 0], T[t, :3, 1], T[t, :3, 2], T[t, :3, 3] = right, [0, 0, -1], ahead, position
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ T[t, :3, :3].T
        depth[t] = _cast(position.astype(np.float32), rays.astype(np.float32), boxes, colours, textures)[0]
        position = position + carried.step_m * (1 + carried.swing * np.sin(t / 9 + phase)) * ahead
        yaw += np.deg2rad(carried.turn_deg) * np.sqrt(2) * np.sin(t / 10 + phase)
    return T, depth


def sound_windows(carried: Carried) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Windows without end, but for those whose camera drives through furniture: what it sees there is no motion."""
    for seed in count():
        boxes_m = _furnish(np.random.default_rng(seed))[0][1:]
        T, depth = window(seed, carried)
        at_m = T[:, None, :3, 3]
        if not ((at_m >= boxes_m[:, 0]) & (at_m <= boxes_m[:, 1])).all(axis=-1).any():
            yield T, depth


def _fractal_of_nothing() -> np.ndarray:
    return np.zeros((1024, 1024), np.float32)


def sensed(T: np.ndarray, depth: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    noisy = depth + rng.normal(size=depth.shape) * (0.0012 + 0.0019 * (depth - 0.4) ** 2)
    steep = np.abs(np.diff(depth, axis=2, append=depth[:, :, -1:])) > 0.1 * depth
    holes = np.stack([cv2.dilate(one.astype(np.uint8), np.ones((3, 3), np.uint8)) for one in steep]) > 0
    depth = np.where(holes, 0, np.rint(noisy / 1e-3) * 1e-3).astype(np.float32)
    poses = T.copy()
    for t in range(len(T)):
        poses[t, :3, :3] = T[t, :3, :3] @ cv2.Rodrigues(np.deg2rad(0.5) / np.sqrt(3) * rng.normal(size=3))[0]
        poses[t, :3, 3] += 0.01 / np.sqrt(3) * rng.normal(size=3)
    return poses, depth


def refused(T: np.ndarray, depth: np.ndarray, max_error: float) -> list[str]:
    """The checks of motion that refuse a window."""
    names = tuple(str(t) for t in range(len(T)))
    record = EpisodeRecord(
        id=EpisodeId("noise_made", "room", "0"),
        container="room",
        rgb_members=names,
        depth_members=names,
        T_world_camera=T,
        intrinsics=K,
        camera_height_m=1.0,
        camera_pitch_rad=0.0,
        frames_digest="",
        content_digest="",
    )
    numbers, depth_m = range(len(T)), dict(enumerate(depth))
    steps = chained_steps(record, numbers)
    pairs = sorted({*spread_pairs(record, numbers), *steps})
    verdicts = {
        "depth_agreement": check_depth_agreement(record, depth_m, pairs, "opencv", max_error),
        "depth_motion": check_depth_motion(record, depth_m, steps, max_error),
        "time_offset": check_time_offset(record, normalise_depth(depth, DepthRange()), DepthRange()),
    }
    return [name for name, verdict in verdicts.items() if not verdict.keep]


def planted(poses: np.ndarray, depth: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """A window as it is, with depth one frame late, and without the image in the middle."""
    return {
        "sound": (poses, depth),
        "slip": (poses[1:], depth[:-1]),
        "gap": (poses[:-1], np.delete(depth, FRAMES // 2, axis=0)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--windows", type=int, default=WINDOWS)
    windows = parser.parse_args().windows
    cv2.setNumThreads(1)
    found: dict[str, dict[str, Counter[str]]] = {name: {kind: Counter() for kind in KINDS} for name in CARRIED}
    sources = {name: sound_windows(carried) for name, carried in CARRIED.items()}
    for number in range(windows):
        for name, carried in CARRIED.items():
            T, depth = next(sources[name])
            seen = {"exact": (T, depth), "noisy": sensed(T, depth, np.random.default_rng(number))}
            for noise, as_seen in seen.items():
                for what, window_of in planted(*as_seen).items():
                    by = refused(*window_of, carried.max_error)
                    found[name][f"{noise} {what}"].update([*by, *(["any"] if by else [])])
        if (number + 1) % WRITTEN_EVERY == 0 or number + 1 == windows:
            report(found, number + 1)


def report(found: dict[str, dict[str, Counter[str]]], windows: int) -> None:
    setup = machine("numpy", "numba")
    rows = [[name, *(f"{sums[kind]['any']} of {windows}" for kind in KINDS)] for name, sums in found.items()]
    lines = [
        "# Sound windows, slips of one frame and missing images, under the noise of a hand-held Kinect",
        "",
        f"{windows} windows of {FRAMES} frames each; refused by any of the checks of motion.",
        "",
        *table(["camera", *(f"{kind}: refused" for kind in KINDS)], rows),
        "",
        *[f"- {name}, {kind}: {dict(sums[kind]) or 'none'}" for name, sums in found.items() for kind in KINDS],
        "",
        machine_line(setup),
    ]
    counts = {name: {kind: dict(sums[kind]) for kind in KINDS} for name, sums in found.items()}
    write_results("sensor_noise", {"machine": setup, "windows": windows, "refused": counts}, lines)


if __name__ == "__main__":
    main()
