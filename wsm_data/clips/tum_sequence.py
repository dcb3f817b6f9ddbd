"""A clip as a sequence of TUM's RGB-D benchmark, for SLAM programs that read those."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from wsm_data.clips.decoded import DecodedVideo
from wsm_data.files.atomic import write_bytes, write_text
from wsm_data.files.json_values import to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.metrics.tum import StampedTrajectory, write_tum
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.clip import Clip
from wsm_data.synth.writers.images import depth_codes, encode_png_16

_UNITS_PER_METRE = 5000  # as in the benchmark; 16 bits reach 13.1 m
_FRAME_S = 0.15  # nominal, one control step: a release keeps no times
_PNG_LEVEL = 6


def write_tum_sequence(folder: Path, clip: Clip, decoded: DecodedVideo) -> None:
    """Write rgb/, depth/, their lists, groundtruth.txt (OpenCV camera to world, z up, m) and the camera.

    `camera.txt` holds `fx fy cx cy`, pixel centres at whole numbers; `camera.json` the size of the images and the scale
    of depth too. Depth is 0 where less than half of a latent cell was measured, or where it is too far for 16 bits. A
    clip without depth has neither depth/ nor depth.txt nor associations.txt. Each file is replaced as a whole, and the
    lists come last.

    Args:
        folder: of the sequence.
        clip: the clip.
        decoded: what its latents decode to at the frames that are written, rising.
    """
    for name in ("rgb", "depth") if clip.has_depth else ("rgb",):
        (folder / name).mkdir(parents=True, exist_ok=True)
    stamps_s = _FRAME_S * np.array(decoded.frames, np.float64)
    stamps = [f"{stamp:.6f}" for stamp in stamps_s]
    for number, stamp in enumerate(stamps):
        _, data = cv2.imencode(".png", cv2.cvtColor(decoded.rgb[number], cv2.COLOR_RGB2BGR))
        write_bytes(folder / f"rgb/{stamp}.png", data.tobytes())
        if clip.has_depth:
            depth_m = np.where(decoded.measured[number], decoded.depth_m[number], np.float32(0))
            codes = depth_codes(depth_m, 1 / _UNITS_PER_METRE)
            write_bytes(folder / f"depth/{stamp}.png", encode_png_16(codes, _PNG_LEVEL))
    _write_camera(folder, clip)
    T_world_camera = _world_poses(clip)[list(decoded.frames)]
    write_tum(folder / "groundtruth.txt", StampedTrajectory(stamps_s=stamps_s, T_world_camera=T_world_camera))
    _write_lists(folder, stamps, clip.has_depth)


def _world_poses(clip: Clip) -> Float64Array:
    """OpenCV camera to world of every raw frame, padding included; float64 [T, 4, 4], m."""
    return np.asarray(clip.meta.T_world_camera0_matrix @ transforms_from_vectors(clip.poses.astype(np.float64)))


def _write_camera(folder: Path, clip: Clip) -> None:
    K = clip.intrinsics
    write_text(folder / "camera.txt", f"{K.fx!r} {K.fy!r} {K.cx!r} {K.cy!r}\n")
    facts = {**to_json(K), "depth_units_per_metre": _UNITS_PER_METRE, "key": clip.meta.key}
    write_text(folder / "camera.json", canonical_json(facts) + "\n")


def _write_lists(folder: Path, stamps: Sequence[str], has_depth: bool) -> None:
    names = ("rgb", "depth") if has_depth else ("rgb",)
    for name in names:
        write_text(folder / f"{name}.txt", "".join(f"{stamp} {name}/{stamp}.png\n" for stamp in stamps))
    if has_depth:
        lines = (f"{stamp} rgb/{stamp}.png {stamp} depth/{stamp}.png\n" for stamp in stamps)
        write_text(folder / "associations.txt", "".join(lines))
