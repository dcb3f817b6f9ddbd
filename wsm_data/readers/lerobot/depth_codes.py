"""LeRobot's quantisation of depth videos, done and undone.

A code q of 12 bits stands for exp(a + q (b - a) / 4095) - shift metres, with a = log(depth_min + shift) and
b = log(depth_max + shift); without logarithm for depth_min + q (depth_max - depth_min) / 4095 (LeRobot 0.6,
`datasets/depth_utils.py`). What was nearer or farther, and what was not measured (0), was clipped: so the lowest and
the highest code say nothing, and are no measurement here.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsm_data.schema.arrays import Float32Array, Uint16Array

CODES = 1 << 12
_UINT16_MAX = np.iinfo(np.uint16).max


@dataclass(frozen=True, kw_only=True)
class DepthQuantisation:
    """How metres became codes.

    Attributes:
        depth_min: depth of code 0, m.
        depth_max: depth of the highest code, m.
        shift: added before the logarithm, m.
        use_log: whether codes are even in the logarithm.
    """

    depth_min: float
    depth_max: float
    shift: float
    use_log: bool

    def __post_init__(self) -> None:
        finite = all(map(math.isfinite, (self.depth_min, self.depth_max, self.shift)))
        if (
            not finite
            or not 0 <= self.depth_min < self.depth_max
            or (self.use_log and self.depth_min + self.shift <= 0)
        ):
            raise ValueError(f"a quantisation of depth needs 0 <= depth_min < depth_max and a logarithm, found {self}")


def codes_from_depth(depth_m: Float32Array, quantisation: DepthQuantisation) -> Uint16Array:
    """The nearest code of each depth, uint16 in the shape of `depth_m`; 0 where there is no measurement, 0 m."""
    low, high, depth = quantisation.depth_min, quantisation.depth_max, np.asarray(depth_m, np.float64)
    if quantisation.use_log:
        low, high = math.log(low + quantisation.shift), math.log(high + quantisation.shift)
        depth = np.log(depth + quantisation.shift)
    return np.rint(np.clip((depth - low) / (high - low), 0, 1) * (CODES - 1)).astype(np.uint16)


def quantisation_of(feature: Mapping[str, Any]) -> DepthQuantisation:
    """What the `info` of a depth feature says of its codes.

    Raises:
        ValueError: it is no depth feature, or does not say how it was quantised.
    """
    info = feature.get("info") or {}
    if not (info.get("is_depth_map") or info.get("video.is_depth_map")):
        raise ValueError("its info must say is_depth_map, or its video is a picture of depth and no measurement")
    wanted = ("depth_min", "depth_max", "shift", "use_log")
    missing = [name for name in wanted if f"video.{name}" not in info]
    if missing:
        raise ValueError(f"its info must say how depth was quantised, and lacks video.{', video.'.join(missing)}")
    low, high, shift = (float(info[f"video.{name}"]) for name in wanted[:3])
    return DepthQuantisation(depth_min=low, depth_max=high, shift=shift, use_log=bool(info["video.use_log"]))


def raw_depth_table(quantisation: DepthQuantisation, metres_per_unit: float) -> Uint16Array:
    """Depth of every code in the units of a manifest, 0 without measurement; uint16 [4096].

    What does not fit into 16 bits of that unit is no measurement either.
    """
    share = np.arange(CODES) / (CODES - 1)
    low, high = quantisation.depth_min, quantisation.depth_max
    if quantisation.use_log:
        a, b = np.log(low + quantisation.shift), np.log(high + quantisation.shift)
        depth_m = np.exp(a + share * (b - a)) - quantisation.shift
    else:
        depth_m = low + share * (high - low)
    raw = np.rint(depth_m / metres_per_unit)
    raw[[0, -1]] = 0
    return np.where((raw >= 0) & (raw <= _UINT16_MAX), raw, 0).astype(np.uint16)
