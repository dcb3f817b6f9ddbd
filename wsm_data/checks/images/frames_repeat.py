"""Are images there twice where the camera moved in between?"""

from collections.abc import Sequence

import numpy as np

from wsm_data.errors import Reason
from wsm_data.files.digest import xxh3_128
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import DepthFrame, EpisodeFrames, RgbFrame
from wsm_data.schema.verdict import Verdict

MOVED_M = 0.02
MOVED_RAD = 0.02
"""A camera that moved or turned so far has another image: noise alone makes two images of a sensor differ."""


def check_frames_repeat(record: EpisodeRecord, frames: EpisodeFrames, max_share: float) -> Verdict:
    """Refuse a trajectory with images that are copies of others, by digest (`frame.repeated`).

    A camera that stands still may show the same again, so only those count between which the poses move.

    Args:
        record: the trajectory.
        frames: its images.
        max_share: largest share of the frames, in colour or in depth, that may be copies.
    """
    copies = {"colour": _copies(record, frames.rgb), "depth": _copies(record, frames.depth)}
    shares = {kind: len(found) / record.frame_count for kind, found in copies.items()}
    worst = max(shares, key=lambda kind: shares[kind])
    measured: dict[str, object] = {f"repeated_{kind}_share": share for kind, share in shares.items()}
    limits = dict.fromkeys(measured, max_share)
    if shares[worst] <= max_share:
        return Verdict(measured=measured, limits=limits)
    first, again = copies[worst][0]
    message = (
        f"{record.id.text}: images must differ where the camera moved, and {len(copies[worst])} {worst} images are "
        f"copies of others: the first is that of frame {again}, of frame {first}; fetch the source again, or leave "
        "these out"
    )
    details = {**measured, "frame": again, "copy_of": first, "kind": worst}
    return Verdict(reason=Reason.FRAME_REPEATED, message=message, measured=details, limits=limits)


def _copies(record: EpisodeRecord, images: Sequence[RgbFrame | DepthFrame | None]) -> list[tuple[int, int]]:
    """Pairs of a frame and a later one with the same image, between which the camera moved."""
    last: dict[str, int] = {}
    pairs = []
    for number, image in enumerate(images):
        if image is None:
            continue
        digest = xxh3_128(image if isinstance(image, bytes) else np.ascontiguousarray(image).tobytes())
        if digest in last:
            pairs.append((last[digest], number))
        last[digest] = number
    return [(a, b) for a, b in pairs if _moved(record.T_world_camera[a], record.T_world_camera[b])]


def _moved(T_world_a: Float64Array, T_world_b: Float64Array) -> bool:
    T_a_b = invert(T_world_a) @ T_world_b
    return bool(np.linalg.norm(T_a_b[:3, 3]) > MOVED_M or rotation_angle_rad(T_a_b[None, :3, :3])[0] > MOVED_RAD)
