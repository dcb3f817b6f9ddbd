"""A query rolled out: its history through the model's own estimates, and a group of dreams from it.

Shape suffixes: F latents of the history, G dreams, K latents of a dream, C channels, h rows and w columns of a latent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_data.files.digest import xxh3_64
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.maps.reward_map import RewardMap
from wsm_data.metrics.trajectory import sim3_residual_m
from wsm_data.schema.arrays import Float64Array
from wsm_model.inference.session import Episode, Session
from wsm_model.posttraining.reward import RewardConfig, Scored, dream_paths_m, score_dreams


@dataclass(frozen=True, kw_only=True, eq=False)
class Query:
    """What post-training is asked at: a clip up to a latent, its goal, and the map that scores what comes next.

    Attributes:
        key: of the clip.
        scene: that it was recorded in.
        replan_latent: number of the last latent that is seen.
        rgb: standardised RGB latents up to it, [F, C, h, w].
        goal_camera0_m: goal in the first camera's frame; [3], m.
        T_world_camera: true pose of the last frame; float64 [4, 4].
        true_m: true camera centres of all frames in the first camera's frame; float64 [4 F, 3].
        expert_distance_m: distance of the expert to the goal at the last frame and at each later one; [1 + 4 K], m.
        reward_map: map and distances.
    """

    key: str
    scene: str
    replan_latent: int
    rgb: Tensor
    goal_camera0_m: Tensor
    T_world_camera: Float64Array
    true_m: Float64Array
    expert_distance_m: Float64Array
    reward_map: RewardMap


@dataclass(frozen=True, kw_only=True, eq=False)
class Group:
    """Dreams of a query, and what they are worth.

    Attributes:
        episode: the history that they share.
        rgb: standardised RGB latents of the dreams, [G, K, C, h, w].
        start_xy_m: where they begin, in the world; float64 [2].
        paths_xy_m: where they lead; float64 [G, 4 K, 2].
        scored: safety, cost and reward.
        ate_rmse_sim3_m: error of the estimated history, after Sim(3) alignment.
    """

    episode: Episode
    rgb: Tensor
    start_xy_m: Float64Array
    paths_xy_m: Float64Array
    scored: Scored
    ate_rmse_sim3_m: float


def roll_out(
    session: Session, query: Query, noise_GKChw: Tensor, schedule: Sequence[float], config: RewardConfig
) -> Group:
    """Observe the history of a query, dream from it, and score the dreams.

    The history is taken in as in use: states are the model's own estimates. Dreams are placed in the map by the true
    pose of the last frame, so that what they are scored for is the motion from there on.
    """
    episode = session.start()
    seen = session.observe_all(episode, query.rgb)
    [dream] = session.dream([episode], query.goal_camera0_m[None], noise_GKChw[None], schedule)
    estimated = _transforms(seen.poses.flatten(0, 1))
    start, paths = dream_paths_m(query.T_world_camera, estimated[-1], _transforms(dream.poses.flatten(1, 2)))
    return Group(
        episode=episode,
        rgb=dream.rgb,
        start_xy_m=start,
        paths_xy_m=paths,
        scored=score_dreams(query.reward_map, start, paths, query.expert_distance_m, config),
        ate_rmse_sim3_m=sim3_residual_m(estimated[:, :3, 3], query.true_m),
    )


def _transforms(poses: Tensor) -> Float64Array:
    """Poses [..., 7] as matrices; float64 [..., 4, 4]."""
    vectors = poses.double().cpu().numpy()
    found = transforms_from_vectors(vectors.reshape(-1, vectors.shape[-1]))
    return np.asarray(found.reshape(*vectors.shape[:-1], 4, 4))


def generator_of(query: Query, seed: int, epoch: int) -> torch.Generator:
    """The source of all that is drawn for a query: it depends on the query alone, not on its place in a step."""
    text = f"{seed}/{epoch}/{query.key}/{query.replan_latent}"
    return torch.Generator().manual_seed(int(xxh3_64(text.encode()), 16) >> 1)
