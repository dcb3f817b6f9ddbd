"""What a clip holds."""

import math
from dataclasses import dataclass, field

from wsm_data.codecs.base import SIDE_MULTIPLE_PX
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_data.schema.surface import CELL_SIZE_M

MIN_GOAL_RADIUS_M = math.sqrt(2) * CELL_SIZE_M
"""The expert's distance is sampled between the four cell centres around it. With a goal region that holds them wherever
in the cell the expert stops, its last distance is zero, as a release promises."""


@dataclass(frozen=True, kw_only=True)
class ClipConfig:
    """What a clip holds; where the paper is silent, the comment says so.

    Attributes:
        width: encoded width, px (table 4).
        height: encoded height, px (table 4).
        depth_range: metric range of the log-depth normalisation (app. A.1).
        still_frames: repeats of the last frame after the end, so that staying is learned; paper silent, K M = 16.
        goal_radius_m: radius r_g of the goal region, m (table 5).
        map_margin_m: the map crop reaches this far beyond path and goal, m; paper silent.
        fill_holes_cells: gaps of so many unknown cells between free ones are free, see `maps.holes`; paper silent, 0:
            unknown is unknown.
    """

    width: int = 320
    height: int = 192
    depth_range: DepthRange = field(default_factory=DepthRange)
    still_frames: int = 16
    goal_radius_m: float = 0.2
    map_margin_m: float = 2.0
    fill_holes_cells: int = 0

    def __post_init__(self) -> None:
        if min(self.width, self.height) <= 0 or self.width % SIDE_MULTIPLE_PX or self.height % SIDE_MULTIPLE_PX:
            raise ValueError(
                f"width and height must be multiples of {SIDE_MULTIPLE_PX} px, found {self.width} and {self.height}"
            )
        if self.still_frames < 0 or self.still_frames % TEMPORAL_RATIO:
            raise ValueError(f"still_frames must be a multiple of {TEMPORAL_RATIO}, found {self.still_frames}")
        if self.goal_radius_m < MIN_GOAL_RADIUS_M:
            raise ValueError(
                f"goal_radius_m must be at least {MIN_GOAL_RADIUS_M:.3f} m, the diagonal of a map cell, found "
                f"{self.goal_radius_m}"
            )
        if self.map_margin_m < 0:
            raise ValueError(f"map_margin_m must not be negative, found {self.map_margin_m}")
        if self.fill_holes_cells < 0:
            raise ValueError(f"fill_holes_cells must not be negative, found {self.fill_holes_cells}")
