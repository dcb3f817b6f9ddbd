"""How much of the depth says nothing: no measurement, or beyond the range that is told apart."""

import numpy as np

from wsm_data.curation.scorers.clip_images import ClipImages
from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scores_table import Direction, ScorerInfo

_FULL = 255
_LIMIT = 0.98
"""Decoded log-depth 2u - 1 this near to 1 or -1 is at the limit: depths beyond 4.84 m, or nearer than 0.207 m."""


def invalid_share(images: ClipImages) -> float | None:
    """Share of depth pixels without a measurement; None where there is no depth."""
    if images.depth_valid is None:
        return None
    return 1.0 - float(images.depth_valid.sum(dtype=np.int64)) / (_FULL * images.depth_valid.size)


def saturated_share(images: ClipImages) -> float | None:
    """Share of depth pixels that are measured and lie at one of the limits of the depth range, in decoded frames.

    Pixels without a measurement are encoded as the far limit, so those of each latent cell are taken off the pixels
    of that cell that lie there. None where no depth was decoded.
    """
    if images.depth_valid is None or not len(images.sampled):
        return None
    frames, height, width = images.sampled_depth.shape
    valid = images.depth_valid[images.sampled] / _FULL
    rows, columns = valid.shape[1:]
    cells = images.sampled_depth.reshape(frames, rows, height // rows, columns, width // columns)
    far = (cells >= _LIMIT).mean(axis=(2, 4)) - (1 - valid)
    near = (cells <= -_LIMIT).mean(axis=(2, 4))
    return float((np.maximum(far, 0.0) + near).mean())


DEPTH_INVALID = Scorer(
    info=ScorerInfo(
        name="depth_invalid_share",
        unit="share",
        direction=Direction.HIGHER,
        summary="share of depth pixels without a measurement",
        absent="the clip has no depth",
    ),
    score=invalid_share,
)
DEPTH_SATURATED = Scorer(
    info=ScorerInfo(
        name="depth_saturated_share",
        unit="share",
        direction=Direction.HIGHER,
        summary="share of measured depth pixels at the limits of the depth range, in a few decoded frames",
        absent="the clip has no depth, or it was not decoded: not asked for, or a codec that decodes no latent alone",
    ),
    score=saturated_share,
)
