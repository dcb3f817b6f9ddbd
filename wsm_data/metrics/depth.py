"""Errors of depth maps as depth estimation reports them (Eigen et al., 2014): AbsRel, delta_1 and the log error."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray

_DELTA = 1.25


@dataclass(frozen=True, kw_only=True)
class DepthErrors:
    """Means over the pixels that count.

    Attributes:
        abs_rel: |d - d*| / d*.
        delta1: share of pixels with max(d / d*, d* / d) < 1.25.
        log_rmse: root of the mean of (ln d - ln d*)^2; nothing is aligned.
    """

    abs_rel: float
    delta1: float
    log_rmse: float


def depth_errors(estimated_m: NDArray[np.floating], true_m: NDArray[np.floating], counts: BoolArray) -> DepthErrors:
    """Compare depths of one shape, m, where `counts` holds.

    Raises:
        ValueError: the shapes differ, no pixel counts, or a depth that counts is not above 0.
    """
    if not estimated_m.shape == true_m.shape == counts.shape or not counts.any():
        raise ValueError(
            f"estimate, truth and mask must have one shape and a pixel that counts, found {estimated_m.shape}, "
            f"{true_m.shape} and {counts.shape} with {int(counts.sum())} pixels"
        )
    estimated, true = (depth[counts].astype(np.float64) for depth in (estimated_m, true_m))
    if not (estimated > 0).all() or not (true > 0).all():
        raise ValueError("depths that count must be above 0 m; leave pixels without a measurement out of the mask")
    log_error = np.log(estimated / true)
    return DepthErrors(
        abs_rel=float(np.mean(np.abs(estimated - true) / true)),
        delta1=float(np.mean(np.abs(log_error) < np.log(_DELTA))),
        log_rmse=float(np.sqrt(np.mean(np.square(log_error)))),
    )
