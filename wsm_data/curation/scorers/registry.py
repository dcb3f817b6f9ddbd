"""All scores of clips, in the order of their columns."""

from wsm_data.curation.scorers.clearance import LEAST_CLEARANCE, TIGHT_SHARE
from wsm_data.curation.scorers.clip_images import ClipImages
from wsm_data.curation.scorers.dead_end import GREATEST_RETREAT, TRAPPED_SHARE
from wsm_data.curation.scorers.depth_quality import DEPTH_INVALID, DEPTH_SATURATED
from wsm_data.curation.scorers.detour import DETOUR
from wsm_data.curation.scorers.goal_view import GOAL_BEHIND_WALLS, GOAL_OUT_OF_VIEW
from wsm_data.curation.scorers.passage import NARROWEST_PASSAGE
from wsm_data.curation.scorers.path_length import PATH_LENGTH
from wsm_data.curation.scorers.reachable import GOAL_REACHABLE
from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.texture import TEXTURE
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scorers.turning import SHARPEST_TURN, TOTAL_TURNING
from wsm_data.curation.scorers.unknown_map import UNKNOWN_SHARE
from wsm_data.curation.scorers.view_change import VIEW_CHANGE

GEOMETRY_SCORERS: tuple[Scorer[Trajectory], ...] = (
    PATH_LENGTH,
    DETOUR,
    TOTAL_TURNING,
    SHARPEST_TURN,
    LEAST_CLEARANCE,
    TIGHT_SHARE,
    NARROWEST_PASSAGE,
    GREATEST_RETREAT,
    TRAPPED_SHARE,
    GOAL_BEHIND_WALLS,
    GOAL_OUT_OF_VIEW,
    UNKNOWN_SHARE,
    VIEW_CHANGE,
    GOAL_REACHABLE,
)
"""Scores of a trajectory on its map."""

IMAGE_SCORERS: tuple[Scorer[ClipImages], ...] = (DEPTH_INVALID, DEPTH_SATURATED, TEXTURE)
"""Scores of what the camera saw."""
