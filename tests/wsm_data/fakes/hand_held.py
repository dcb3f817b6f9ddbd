"""A hand-held sequence of a generated home in the layout of TUM's benchmark, as a person with a Kinect has it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from wsm_data.schema.camera import Intrinsics
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.drive.expert import plan_episode
from wsm_data.synth.drive.occupancy import scene_columns
from wsm_data.synth.home.home import make_home
from wsm_data.synth.render.render import render

CAMERA = Intrinsics(fx=160.0, fy=161.0, cx=79.5, cy=59.5, width=160, height=120)
METRES_PER_UNIT = 1 / 5000
FIRST_STAMP_S = 1305031102.175304
STEP_M = 0.02
"""Way between two frames at 30 Hz."""


@dataclass(frozen=True, kw_only=True)
class HandHeld:
    """What was written.

    Attributes:
        stamps_s: of all colour images; float64 [N].
        T_world_camera: the true poses at these times; float64 [N, 4, 4].
        with_depth: which have a depth image; bool [N].
    """

    stamps_s: np.ndarray
    T_world_camera: np.ndarray
    with_depth: np.ndarray


def write_hand_held(folder: Path, *, frames: int = 150, seed: int = 0) -> HandHeld:
    """Render a walk and write rgb/, depth/, rgb.txt, depth.txt, groundtruth.txt and camera.txt."""
    rng = np.random.default_rng(seed)
    home = make_home(seed, 0)
    T = _held(_walk(home, frames, rng))
    stamps = FIRST_STAMP_S + np.cumsum(rng.uniform(0.028, 0.038, frames))
    with_depth = np.ones(frames, bool)
    with_depth[[3, 40, 41, 90]] = False
    for kind in ("rgb", "depth"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    lists = {"rgb": ["# color images", "# file: 'made.bag'", "# timestamp filename"], "depth": ["# depth maps"]}
    for number, (stamp, pose) in enumerate(zip(stamps, T, strict=True)):
        rgb, depth_m = render(home.mesh, pose, CAMERA)
        _write_image(folder, lists["rgb"], "rgb", stamp, rgb[..., ::-1])
        if with_depth[number]:
            codes = np.rint(depth_m / METRES_PER_UNIT)
            codes = np.where(codes <= 65535, codes, 0).astype(np.uint16)
            _write_image(folder, lists["depth"], "depth", stamp + rng.uniform(-0.008, 0.008), codes)
    for kind, lines in lists.items():
        (folder / f"{kind}.txt").write_text("\n".join(lines) + "\n")
    (folder / "groundtruth.txt").write_text(_trajectory(stamps, T))
    (folder / "camera.txt").write_text(f"# fx fy cx cy\n{CAMERA.fx} {CAMERA.fy} {CAMERA.cx} {CAMERA.cy}\n")
    return HandHeld(stamps_s=stamps, T_world_camera=T, with_depth=with_depth)


def walk_frames(frames: int, seed: int = 0) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Colour, depth and pose of each frame of a walk, as arrays."""
    home = make_home(seed, 0)
    for pose in _held(_walk(home, frames, np.random.default_rng(seed))):
        rgb, depth_m = render(home.mesh, pose, CAMERA)
        yield rgb, depth_m, pose


def _walk(home, frames: int, rng: np.random.Generator) -> np.ndarray:
    """Level poses of an expert at 1.2 m that goes `STEP_M` a frame."""
    config = SynthConfig(
        min_frames=frames, max_frames=frames, min_step_m=STEP_M, max_step_m=STEP_M * 1.4,
        min_camera_height_m=1.2, max_camera_height_m=1.2, max_pitch_deg=0.0,
    )  # fmt: skip
    return plan_episode(home, scene_columns(home), rng, config).T_world_camera


def _held(T_level: np.ndarray) -> np.ndarray:
    """The same walk with a hand's bob, and slow swings of roll up to 12 and of pitch of 8 about 15 degrees."""
    t = np.arange(len(T_level))
    angles = np.stack([np.deg2rad(-15 + 8 * np.sin(t / 23)), 0 * t, np.deg2rad(12 * np.sin(t / 31))], axis=1)
    T = T_level.copy()
    T[:, :3, :3] = T_level[:, :3, :3] @ Rotation.from_euler("xyz", angles).as_matrix()
    T[:, 2, 3] += 0.03 * np.sin(t / 9)
    return T


def _write_image(folder: Path, lines: list[str], kind: str, stamp: float, image: np.ndarray) -> None:
    name = f"{kind}/{stamp:.6f}.png"
    lines.append(f"{stamp:.6f} {name}")
    assert cv2.imwrite(str(folder / name), image)


def _trajectory(stamps: np.ndarray, T: np.ndarray) -> str:
    """Poses at 100 Hz, as motion capture gives them: at times of its own, on the straight way between frames."""
    times = np.arange(stamps[0] - 0.05, stamps[-1] + 0.05, 0.01)
    times = np.sort(np.concatenate([times, stamps]))
    xyz = np.stack([np.interp(times, stamps, T[:, axis, 3]) for axis in range(3)], axis=1)
    key = np.clip(np.searchsorted(stamps, times, side="right") - 1, 0, len(stamps) - 2)
    share = np.clip((times - stamps[key]) / (stamps[key + 1] - stamps[key]), 0, 1)
    first, second = Rotation.from_matrix(T[key, :3, :3]), Rotation.from_matrix(T[key + 1, :3, :3])
    turned = first * Rotation.from_rotvec((first.inv() * second).as_rotvec() * share[:, None])
    rows = np.column_stack([times, xyz, turned.as_quat()])
    kept = np.concatenate([[True], np.diff(np.round(times, 6)) > 0])
    lines = [" ".join([f"{row[0]:.6f}", *(f"{value:.6f}" for value in row[1:])]) for row in rows[kept]]
    return "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n"
