"""Does every image fit between its neighbours in time?

An image that is another's, or nobody's, is far from the ones before and after it, while these are near each other. In
a sound video the way from before to after leads through what lies between. Of longer pieces that does not hold: a
camera may turn to the side and back.
"""

import cv2
import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.verdict import Verdict

RATIO = 2.0
"""How many times nearer to each other the images around a foreign one must be than to it,"""

NOISE = 0.15
"""beyond this distance, in standard deviations of an image: what noise and compression make of the same view."""

BLOCK_PX = 12
"""An image is told by the means of blocks of such a side: single pixels on a lattice are met by the rim of a door for
the length of one frame, all of a column at once."""


def check_frame_order(video: Float32Array, kind: str, where: str) -> Verdict:
    """Refuse a video with images that do not belong where they are (`frame.out_of_order`).

    Args:
        video: one channel of the frames; float32 [T, H, W].
        kind: `colour` or `depth`.
        where: what to call the trajectory in the message.
    """
    ratios = foreign_ratios(signatures(video))
    foreign = (np.flatnonzero(ratios > RATIO) + 1).tolist()
    measured: dict[str, object] = {f"{kind}_foreign_ratio": float(ratios.max(initial=0.0))}
    limits = {f"{kind}_foreign_ratio": RATIO}
    if not foreign:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: every {kind} image must be on the way from the one before it to the one after it, and "
        f"{len(foreign)} are {RATIO:g} times as far from these as they are from each other, or more; the first is "
        f"frame {foreign[0]}; are images exchanged, blank or of another trajectory?"
    )
    details = {**measured, "frame": foreign[0], "frames": len(foreign)}
    return Verdict(reason=Reason.FRAME_OUT_OF_ORDER, message=message, measured=details, limits=limits)


def signatures(video: Float32Array) -> Float32Array:
    """Means of blocks of each frame, of mean zero and deviation one whatever its exposure; float32 [T, N]."""
    _, height, width = video.shape
    rows, columns = max(1, height // BLOCK_PX), max(1, width // BLOCK_PX)
    marks = np.stack([cv2.resize(one, (columns, rows), interpolation=cv2.INTER_AREA).ravel() for one in video])
    centred = marks - marks.mean(axis=1, keepdims=True)
    spread = centred.std(axis=1, keepdims=True)
    return (centred / np.where(spread > 1e-3, spread, np.inf)).astype(np.float32)


def foreign_ratios(marks: Float32Array) -> Float64Array:
    """How much farther every frame but the first and last is from the nearer of its neighbours than these are apart.

    The noise of a view is part of every distance; float64 [T - 2].
    """
    if len(marks) < 3:
        return np.zeros(0)
    steps, around = _distances(marks[:-1], marks[1:]), _distances(marks[:-2], marks[2:])
    return np.minimum(steps[:-1], steps[1:]) / (around + NOISE / RATIO)


def _distances(one: Float32Array, other: Float32Array) -> Float64Array:
    return np.abs(one - other).mean(axis=1, dtype=np.float64)
