"""Are images there twice where the camera moved in between?"""

from collections.abc import Sequence

import numpy as np

from wsm_data.checks.depth_pairs import depth_pair, relative_errors
from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes
from wsm_data.errors import Reason
from wsm_data.files.digest import xxh3_128
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import DepthFrame, EpisodeFrames, RgbFrame
from wsm_data.schema.verdict import Verdict

MOVED_M = 0.02
MOVED_RAD = 0.02
"""A camera that moved or turned so far has another image: noise alone makes two images of a sensor differ."""

LONGEST_RUN = 3
"""A sensor that falls behind hands out its last image again, once or twice; one that shows it longer is stuck."""

MAX_POINTS, MIN_POINTS = 1600, 50
MAX_ERROR = 0.003
"""Exact depth may repeat: over a floor without end, or along a bare wall, the motion itself leaves it as it is. Then
each point that is compared, of so many, lies where another lay, to this share of its depth: steps of 1 mm at 0.4 m,
rounded in both images, are 0.0025."""


def check_frames_repeat(
    record: EpisodeRecord, frames: EpisodeFrames, encoding: DepthEncoding, max_share: float
) -> Verdict:
    """Refuse a trajectory with images that are copies of others, by digest (`frame.repeated`).

    A camera that stands still may show the same again, so only those count between which the poses move; and of depth
    images, those that the motion changes. More than `LONGEST_RUN` in a row are refused whatever share is allowed.

    Args:
        record: the trajectory.
        frames: its images.
        encoding: of its depth images.
        max_share: largest share of the frames, in colour or in depth, that may be copies.

    Raises:
        DataError: a depth image that is there twice does not decode.
    """
    copies = {"colour": _copies(record, frames.rgb), "depth": _copies(record, frames.depth)}
    copies["depth"] = [(a, b) for a, b in copies["depth"] if not _unchanged(record, a, b, frames.depth[b], encoding)]
    shares = {kind: len(found) / record.frame_count for kind, found in copies.items()}
    worst = max(shares, key=lambda kind: shares[kind])
    run = max(_longest_run(found) for found in copies.values())
    repeated: dict[str, object] = {f"repeated_{kind}_share": share for kind, share in shares.items()}
    measured = {**repeated, "longest_run": run}
    limits = {**dict.fromkeys(repeated, max_share), "longest_run": LONGEST_RUN}
    if shares[worst] <= max_share and run <= LONGEST_RUN:
        return Verdict(measured=measured, limits=limits)
    first, again = copies[worst][0]
    message = (
        f"{record.id.text}: images must differ where the camera moved, and {len(copies[worst])} {worst} images are "
        f"copies of others, up to {run} in a row are alike: the first is that of frame {again}, of frame {first}; "
        "fetch the source again, or leave these out"
    )
    details = {**measured, "frame": again, "copy_of": first, "kind": worst}
    return Verdict(reason=Reason.FRAME_REPEATED, message=message, measured=details, limits=limits)


def _copies(record: EpisodeRecord, images: Sequence[RgbFrame | DepthFrame | None]) -> list[tuple[int, int]]:
    """Pairs of the first frame with an image and a later one with the same, between which the camera moved."""
    first: dict[str, int] = {}
    pairs = []
    for number, image in enumerate(images):
        if image is None:
            continue
        digest = xxh3_128(image if isinstance(image, bytes) else np.ascontiguousarray(image).tobytes())
        if digest in first:
            pairs.append((first[digest], number))
        first.setdefault(digest, number)
    return [(a, b) for a, b in pairs if _moved(record.T_world_camera[a], record.T_world_camera[b])]


def _longest_run(copies: Sequence[tuple[int, int]]) -> int:
    """How many images in a row are alike, the first and the copies that follow one another; 1 where none are."""
    longest, run, before = 1, 1, (-1, -1)
    for first, again in copies:
        run = run + 1 if before == (first, again - 1) else 2
        longest, before = max(longest, run), (first, again)
    return longest


def _moved(T_world_a: Float64Array, T_world_b: Float64Array) -> bool:
    T_a_b = invert(T_world_a) @ T_world_b
    return bool(np.linalg.norm(T_a_b[:3, 3]) > MOVED_M or rotation_angle_rad(T_a_b[None, :3, :3])[0] > MOVED_RAD)


def _unchanged(record: EpisodeRecord, a: int, b: int, image: DepthFrame | None, encoding: DepthEncoding) -> bool:
    """Whether the motion from frame a to b turns the depth image that both have into itself."""
    if image is None:
        return False
    depth_m = depth_m_from_raw(depth_codes(image, f"{record.id.text}, depth frame {b}"), encoding)
    pair = depth_pair(a, b, {a: depth_m, b: depth_m}, record.intrinsics, MAX_POINTS)
    T_b_a = invert(record.T_world_camera[b]) @ record.T_world_camera[a]
    errors = relative_errors(pair, T_b_a, record.intrinsics)
    seen = np.abs(errors[np.isfinite(errors)])
    return len(seen) >= MIN_POINTS and bool(seen.max() <= MAX_ERROR)
