"""How much the picture moves from one frame to the next."""

import math

import numpy as np

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.geometry.transform import rotation_angle_rad
from wsm_data.maps.ray import free_ahead_m

NEAREST_M, FARTHEST_M = 0.2, 5.0
"""Scene depth is taken for at least and at most this: the range in which the model sees depth (the paper, app. A.1)."""


def view_change_rad(trajectory: Trajectory) -> float:
    """Mean over pairs of frames of rotation plus translation over scene depth, rad.

    A point at depth Z moves in the picture by at most the rotation plus |t| / Z (Longuet-Higgins and Prazdny, "The
    interpretation of a moving retinal image", 1980), for small motions. Z is read off the map: the free distance ahead
    of the first frame of the pair, along the optical axis over the floor. 0 for a single frame.
    """
    rotations = trajectory.T_world_camera[:, :3, :3]
    if len(rotations) == 1:
        return 0.0
    angles = rotation_angle_rad(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:])
    ahead = free_ahead_m(trajectory.map, trajectory.path_xy_m[:-1], trajectory.heading_rad[:-1], FARTHEST_M)
    return math.fsum(angles + trajectory.steps_m / np.maximum(ahead, NEAREST_M)) / len(angles)


VIEW_CHANGE = Scorer(
    info=ScorerInfo(
        name="view_change_rad_per_frame",
        unit="rad per frame",
        direction=Direction.HIGHER,
        summary="mean rotation plus translation over the free distance ahead, from frame to frame",
    ),
    score=view_change_rad,
)
