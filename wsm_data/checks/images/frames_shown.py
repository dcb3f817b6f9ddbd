"""Does every colour image show something?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.verdict import Verdict

LATTICE_PX = 12
MIN_SPREAD = 2.0 / 127.5
SATURATED = 1 - 8 / 127.5
"""Two grey levels of deviation, within eight levels of black or white: a plain wall that fills an image is neither."""


def check_frames_shown(video: Float32Array, where: str) -> Verdict:
    """Refuse a video with images that are black or white throughout (`colour.blank`).

    Args:
        video: one channel of the frames, in [-1, 1]; float32 [T, H, W].
        where: what to call the trajectory in the message.
    """
    points = video[:, LATTICE_PX // 2 :: LATTICE_PX, LATTICE_PX // 2 :: LATTICE_PX].reshape(len(video), -1)
    blank = np.flatnonzero((points.std(axis=1) < MIN_SPREAD) & (np.abs(points.mean(axis=1)) > SATURATED))
    measured: dict[str, object] = {"blank_frames": len(blank)}
    if len(blank) == 0:
        return Verdict(measured=measured, limits={"blank_frames": 0})
    message = (
        f"{where}: every colour image must show something, and {len(blank)} of {len(video)} are black or white "
        f"throughout, the first is frame {blank[0]}; repair the source, or leave them out"
    )
    details = {**measured, "frame": int(blank[0])}
    return Verdict(reason=Reason.COLOUR_BLANK, message=message, measured=details, limits={"blank_frames": 0})
