"""From what happened in an episode to its row in the table."""

import numpy as np

from wsm_data.geometry.planar import points_in_base, relative_to
from wsm_data.metrics.navigation import weighted_success
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m
from wsm_data.schema.arrays import BoolArray
from wsm_data.sim.base import CONTROL_STEP_S
from wsm_data.sim.config import SimConfig
from wsm_data.sim.result import EpisodeResult, Rollout


def score_rollout(rollout: Rollout, planner: str, config: SimConfig) -> EpisodeResult:
    """The numbers of one episode."""
    touching = np.append(False, rollout.contact)
    near = (rollout.clearance_m < config.robot.radius_m + config.near_miss_m) | touching
    episode, goal = rollout.episode, rollout.episode.goal_xy_m
    return EpisodeResult(
        scene=rollout.scene,
        episode=rollout.number,
        planner=planner,
        ending=rollout.ending,
        success=rollout.success,
        spl_geodesic=weighted_success(rollout.success, rollout.geodesic_m, max(rollout.driven_m, 0.0)),
        spl_straight=weighted_success(rollout.success, episode.straight_m, max(rollout.driven_m, 0.0)),
        straight_m=episode.straight_m,
        geodesic_m=rollout.geodesic_m,
        driven_m=rollout.driven_m,
        seconds=len(rollout.commands) * CONTROL_STEP_S,
        navigation_error_m=float(np.linalg.norm(rollout.poses[-1, :2] - goal)),
        localisation_error_m=_localisation_error_m(rollout),
        ate_rmse_unaligned_m=_pose_error_m(rollout),
        collisions=_onsets(touching),
        near_misses=_onsets_without(near, touching),
        plans=len(rollout.answers),
    )


def _onsets(flags: BoolArray) -> int:
    return int(np.count_nonzero(flags[1:] & ~flags[:-1]) + flags[0])


def _onsets_without(near: BoolArray, touching: BoolArray) -> int:
    """Stretches of being near in which nothing was touched."""
    starts = np.flatnonzero(near & ~np.append(False, near[:-1]))
    ends = np.flatnonzero(near & ~np.append(near[1:], False)) + 1
    return sum(not touching[a:b].any() for a, b in zip(starts, ends, strict=True))


def _localisation_error_m(rollout: Rollout) -> float | None:
    for answer in reversed(rollout.answers):
        if answer.plan.goal_estimate_m is not None:
            true = points_in_base(rollout.episode.goal_xy_m[None], answer.pose)[0]
            return float(np.linalg.norm(true - answer.plan.goal_estimate_m[:2]))
    return None


def _pose_error_m(rollout: Rollout) -> float | None:
    pairs = [
        (one.plan.pose_estimate[:2], relative_to(one.pose, rollout.poses[0])[:2])
        for one in rollout.answers
        if one.plan.pose_estimate is not None
    ]
    if not pairs:
        return None
    estimated, true = (np.array(side) for side in zip(*pairs, strict=True))
    return ate_rmse_unaligned_m(estimated, true)
