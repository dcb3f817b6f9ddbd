"""Does every image fit between its neighbours in time?

An image that is another's, or nobody's, is far from the ones before and after it, while these are near each other.
That holds however fast a camera moves: in a sound video the way from before to after leads through what lies between.
"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.verdict import Verdict

LENGTHS = (1, 2, 3, 4, 6, 8)
"""So many images in a row may be foreign and are found; a longer piece is found by the checks of motion."""

RATIO = 2.0
"""How many times nearer to each other the images around a foreign piece must be than to its ends,"""

NOISE = 0.15
"""beyond this distance, in standard deviations of an image: what noise and compression make of the same view."""

LATTICE_PX = 12


def check_frame_order(video: Float32Array, kind: str, where: str) -> Verdict:
    """Refuse a video with images that do not belong where they are (`frame.out_of_order`).

    Args:
        video: one channel of the frames; float32 [T, H, W].
        kind: `colour` or `depth`.
        where: what to call the trajectory in the message.
    """
    marks = signatures(video)
    foreign: set[int] = set()
    worst = 0.0
    for length in LENGTHS:
        ratios = _foreign_ratios(marks, length)
        worst = max(worst, float(ratios.max(initial=0.0)))
        for before in np.flatnonzero(ratios > 1).tolist():
            foreign |= {*range(before + 1, before + 1 + length)}
    measured: dict[str, object] = {f"{kind}_foreign_ratio": RATIO * worst}
    limits = {f"{kind}_foreign_ratio": RATIO}
    if not foreign:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: every {kind} image must be on the way from the one before it to the one after it, and "
        f"{len(foreign)} are {RATIO:g} times as far from these as they are from each other, or more; the first is "
        f"frame {min(foreign)}; are images exchanged, blank or of another trajectory?"
    )
    details = {**measured, "frame": min(foreign), "frames": len(foreign)}
    return Verdict(reason=Reason.FRAME_OUT_OF_ORDER, message=message, measured=details, limits=limits)


def signatures(video: Float32Array) -> Float32Array:
    """Frames on a lattice, each of mean zero and deviation one whatever its exposure; float32 [T, N]."""
    marks = video[:, LATTICE_PX // 2 :: LATTICE_PX, LATTICE_PX // 2 :: LATTICE_PX].reshape(len(video), -1)
    centred = marks - marks.mean(axis=1, keepdims=True)
    spread = centred.std(axis=1, keepdims=True)
    return (centred / np.where(spread > 1e-3, spread, np.inf)).astype(np.float32)


def _foreign_ratios(marks: Float32Array, length: int) -> Float64Array:
    """By the frame before a piece of `length` frames: over 1 where the piece is foreign; float64 [T - length - 1]."""
    if len(marks) < length + 2:
        return np.zeros(0)
    entering = _distances(marks[: -length - 1], marks[1:-length])
    leaving = _distances(marks[length:-1], marks[length + 1 :])
    around = _distances(marks[: -length - 1], marks[length + 1 :])
    return np.minimum(entering, leaving) / (RATIO * around + NOISE)


def _distances(one: Float32Array, other: Float32Array) -> Float64Array:
    return np.abs(one - other).mean(axis=1, dtype=np.float64)
