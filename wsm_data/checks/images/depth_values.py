"""Are depth images measurements: enough of them, fine enough, and smooth where surfaces are?"""

from collections.abc import Sequence

import numpy as np

from wsm_data.checks.limits import verdict_within
from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.source.check_limits import CheckLimits
from wsm_data.schema.verdict import Verdict

MAX_IMAGES, ROWS_APART = 16, 8
MIN_VALUES = 10_000
MAX_8_BIT_VALUES = 256

_TO_DEVIATION = 0.6745 * np.sqrt(6)
"""The median of |x| of a normal variable is 0.6745 deviations; that of a - 2 b + c is sqrt(6) of one of them."""


def check_depth_values(
    depth_m: Sequence[Float32Array], metres_per_unit: float, checks: CheckLimits, where: str
) -> dict[str, Verdict]:
    """Refuse depth that is mostly not there, in steps, or noise, by the name of the check.

    `depth.sparse`: too small a share of the pixels is measured. `depth.coarse`: all codes are multiples of a step, or
    no more than 8 bits could tell apart. `depth.noisy`: along a row of a plane 1 / depth is linear, and what its second
    differences leave is noise, of which the median is taken, since edges are few.

    Args:
        depth_m: some depth images, m, 0 without measurement; float32 [H, W] each.
        metres_per_unit: of the stored codes.
        checks: limits of the source.
        where: what to call the trajectory in messages.
    """
    if not depth_m:
        return {}
    spread = depth_m[:: -(-len(depth_m) // MAX_IMAGES)]
    rows = np.concatenate([image[::ROWS_APART] for image in spread]).astype(np.float64)
    share = float(np.mean(rows > 0))
    noise = _relative_noise(rows)
    step_m, values = _step_m(rows, metres_per_unit)
    coarse = {"depth_step_m": (step_m, 0.0, checks.max_depth_step_m)}
    if np.count_nonzero(rows) >= MIN_VALUES:
        coarse["depth_values"] = (float(values), MAX_8_BIT_VALUES + 1.0, np.inf)
    return {
        "depth_share": verdict_within(
            {"measured_share": (share, checks.min_measured_share, 1.0)},
            Reason.DEPTH_SPARSE,
            f"{where}: depth is not measured in enough pixels",
        ),
        "depth_steps": verdict_within(
            coarse, Reason.DEPTH_COARSE, f"{where}: depth is in steps, as of 8 bits; export it with all its bits"
        ),
        "depth_noise": verdict_within(
            {"relative_depth_noise": (noise, 0.0, checks.max_depth_error)},
            Reason.DEPTH_NOISY,
            f"{where}: depth is noise; are its bytes in order, and its codes metres?",
        ),
    }


def _relative_noise(rows_m: Float64Array) -> float:
    """Standard deviation of depth over depth, from second differences of 1 / depth along rows; 0 where none are."""
    left, middle, right = rows_m[:, :-2], rows_m[:, 1:-1], rows_m[:, 2:]
    whole = (left > 0) & (middle > 0) & (right > 0)
    if not whole.any():
        return 0.0
    left, middle, right = left[whole], middle[whole], right[whole]
    return float(np.median(np.abs(middle / left - 2 + middle / right)) / _TO_DEVIATION)


def _step_m(rows_m: Float64Array, metres_per_unit: float) -> tuple[float, int]:
    """The largest step that all codes are multiples of, m, and how many different codes there are."""
    codes = np.flatnonzero(np.bincount(np.rint(rows_m[rows_m > 0] / metres_per_unit).astype(np.int64)))
    return float(np.gcd.reduce(codes)) * metres_per_unit if len(codes) else 0.0, len(codes)
