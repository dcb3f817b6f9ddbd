"""What a clip holds."""

from dataclasses import dataclass, field

from wsm_data.schema.depth import DepthRange


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
    """

    width: int = 320
    height: int = 192
    depth_range: DepthRange = field(default_factory=DepthRange)
    still_frames: int = 16
    goal_radius_m: float = 0.2
    map_margin_m: float = 2.0
