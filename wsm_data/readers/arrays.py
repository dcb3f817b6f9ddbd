"""Write a source from numpy arrays, frame by frame: the way in for data of any other kind. docs/sources.md shows it.

An episode is a folder `<source>/<scene>/<episode>/` of `rgb/000000.png`, `depth/000000.png` where there is depth, and
`episode.json`. It appears when it is complete, and not at all where a frame is refused. Read it with the manifest
`arrays`.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import cv2
import numpy as np

from wsm_data.geometry.transform import rigidity_error
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array, require_array, require_finite
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.identity import EpisodeId
from wsm_data.synth.writers.containers import Member, write_folder
from wsm_data.synth.writers.images import depth_codes, encode_png_16

Frame = tuple[Uint8Array, Float32Array | None, Float64Array]
"""rgb_u8 [H, W, 3]; depth_m [H, W] along the optical axis, 0 or NaN without measurement; T_world_camera [4, 4]. Depth
is None in all frames of an episode, or in none."""

METRES_PER_UNIT = 1e-4
"""Depth is stored in tenths of a millimetre; what is farther than 6.55 m has no measurement. As the manifest says."""

MAX_RIGIDITY_ERROR = 1e-3
MAX_MEDIAN_DEPTH_M = 100.0
EPISODE_FILE = "episode.json"

_PNG_LEVEL = 2


def write_episode(
    source: Path,
    scene: str,
    episode: str,
    frames: Iterable[Frame],
    *,
    K: Float64Array,
    camera: str = "camera",
    floor_z_m: float | None = None,
    goal_world_m: tuple[float, float, float] | None = None,
) -> Path:
    """Write one episode; returns its folder. One that was there is replaced.

    Args:
        source: root of the source; made where it does not exist.
        scene: name of the place; episodes of a scene share its map, and so its world.
        episode: name of the episode.
        frames: colour, depth and pose of each frame in time order, as a generator gives them. Poses: an
            OpenCV camera (x right, y down, z forward) in a world with z up, m.
        K: camera matrix [3, 3], px, for the centre of the first pixel at (0, 0).
        camera: name of the camera, without `_`.
        floor_z_m: height of the floor, m; None where depth shows it.
        goal_world_m: where the episode leads to, in the world at the height of the camera, m; it must end within the
            goal region there. None: its last position.

    Raises:
        ValueError: an array of another type, shape or size, a pose that is not rigid, depth that is negative or cannot
            be in metres, depth in some frames only, neither depth nor a floor, a goal that is not finite, a camera that
            does not fit the images, a name that is none, or no frame at all.
    """
    EpisodeId(f"arrays_{camera}", scene, episode)  # refuses names that are paths
    if "_" in camera or not camera:
        raise ValueError(f"the name of a camera must not be empty or hold '_', found {camera!r}")
    if goal_world_m is not None:
        require_finite("goal_world_m", np.array(goal_world_m, np.float64))
    said = {"camera": camera, "floor_z_m": floor_z_m, "goal_world_m": goal_world_m}
    folder = source / scene / episode
    write_folder(folder, _members(frames, K, said))
    return folder


def _members(frames: Iterable[Frame], K: Float64Array, said: Mapping[str, object]) -> Iterator[Member]:
    poses: list[list[float]] = []
    with_depth = 0
    intrinsics = None
    for number, (rgb_u8, depth_m, T_world_camera) in enumerate(frames):
        intrinsics = intrinsics or _intrinsics(K, rgb_u8)
        _require_frame(number, rgb_u8, T_world_camera, intrinsics)
        poses.append(np.asarray(T_world_camera, np.float64).ravel().tolist())
        yield f"rgb/{number:06d}.png", cv2.imencode(".png", rgb_u8[..., ::-1])[1].tobytes()
        if depth_m is not None:
            with_depth += 1
            _require_depth(number, depth_m, intrinsics)
            codes = depth_codes(np.nan_to_num(depth_m, posinf=0.0).astype(np.float32), METRES_PER_UNIT)
            yield f"depth/{number:06d}.png", encode_png_16(codes, _PNG_LEVEL)
    if intrinsics is None:
        raise ValueError("an episode must have frames, found none")
    if with_depth not in (0, len(poses)):
        raise ValueError(f"all frames of an episode must have depth, or none, found {with_depth} of {len(poses)}")
    if not with_depth and said["floor_z_m"] is None:
        raise ValueError("floor_z_m must be given where there is no depth that shows the floor, found None")
    stated = {**said, "K": intrinsics.matrix.tolist(), "depth": with_depth > 0, "T_world_camera": poses}
    yield EPISODE_FILE, (json.dumps(stated) + "\n").encode()


def _intrinsics(K: Float64Array, rgb_u8: Uint8Array) -> Intrinsics:
    require_array("rgb_u8 of frame 0", rgb_u8, np.uint8, (None, None, 3))
    matrix = np.asarray(K, np.float64)
    require_array("K", matrix, np.float64, (3, 3))
    if matrix[0, 1] != 0 or matrix[1, 0] != 0 or (matrix[2] != (0, 0, 1)).any():
        raise ValueError(f"K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], found {matrix.tolist()}")
    fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=rgb_u8.shape[1], height=rgb_u8.shape[0])


def _require_frame(number: int, rgb_u8: Uint8Array, T_world_camera: Float64Array, intrinsics: Intrinsics) -> None:
    require_array(f"rgb_u8 of frame {number}", rgb_u8, np.uint8, (intrinsics.height, intrinsics.width, 3))
    require_array(f"T_world_camera of frame {number}", T_world_camera, np.float64, (4, 4))
    require_finite(f"T_world_camera of frame {number}", T_world_camera)
    error = float(rigidity_error(T_world_camera))
    if error > MAX_RIGIDITY_ERROR:
        raise ValueError(
            f"T_world_camera of frame {number} must be a rotation and a translation within {MAX_RIGIDITY_ERROR}, found "
            f"{T_world_camera.tolist()}"
        )


def _require_depth(number: int, depth_m: Float32Array, intrinsics: Intrinsics) -> None:
    require_array(f"depth_m of frame {number}", depth_m, np.float32, (intrinsics.height, intrinsics.width))
    measured = depth_m[depth_m != 0]
    measured = measured[np.isfinite(measured)]
    if len(measured) and (measured.min() < 0 or np.median(measured) > MAX_MEDIAN_DEPTH_M):
        raise ValueError(
            f"depth_m of frame {number} must be in metres and not negative, found {measured.min():g} to "
            f"{measured.max():g} with a median of {np.median(measured):g}; is it in millimetres?"
        )
