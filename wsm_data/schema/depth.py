"""The depth contract: how a source stores depth, and the range in which the model sees it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DepthEncoding:
    """How depth stands in the image files of a source.

    Attributes:
        metres_per_unit: metres of one raw step, along the optical axis.
        invalid_codes: raw values that mean "no measurement".
        bits: bits of a stored sample.
    """

    metres_per_unit: float
    invalid_codes: tuple[int, ...]
    bits: int = 16

    def __post_init__(self) -> None:
        if not 0 < self.metres_per_unit < 1:
            raise ValueError(f"metres_per_unit must lie in (0, 1), found {self.metres_per_unit}")
        if self.bits != 16:
            raise ValueError(f"only 16-bit depth images are supported, found bits = {self.bits}")


@dataclass(frozen=True, kw_only=True)
class DepthRange:
    """The metric range of the log-depth normalisation; the defaults are the paper's (app. A.1, "Depth").

    Attributes:
        min_m: nearest depth that is told apart, m.
        max_m: farthest depth that is told apart, m.
    """

    min_m: float = 0.2
    max_m: float = 5.0

    def __post_init__(self) -> None:
        if not 0 < self.min_m < self.max_m:
            raise ValueError(f"a depth range needs 0 < min_m < max_m, found {self.min_m} and {self.max_m}")
