"""Reward of dreams: safety first, then progress at the expert's pace (paper, section 3.3 and appendix B.2).

Positions are planar, in the world, m. G dreams of a query have L positions each, and begin where the query's frame was
taken.
"""

from dataclasses import dataclass

import numpy as np

from wsm_data.geometry.transform import invert
from wsm_data.maps.footprint import footprints_are_free
from wsm_data.maps.reward_map import RewardMap
from wsm_data.schema.arrays import BoolArray, Float64Array


@dataclass(frozen=True, kw_only=True)
class RewardConfig:
    """How dreams are scored; the defaults are the paper's.

    Attributes:
        temperature_m2: T of the softmax over costs, m^2.
        bonus: whether the best safe dream gains what it is better by.
    """

    temperature_m2: float = 0.01
    bonus: bool = True

    def __post_init__(self) -> None:
        if not self.temperature_m2 > 0:
            raise ValueError(f"temperature_m2 must be above 0, found {self.temperature_m2}")


@dataclass(frozen=True, kw_only=True)
class Scored:
    """A group of dreams, scored.

    Attributes:
        safe: s, whether the footprint stays in free space along the way; bool [G].
        cost_m2: C, mean squared difference of progress to the expert's, m^2; float64 [G], infinite where the distance
            to the goal is not known on the way.
        reward: r in [0, 1]; float64 [G].
        value: s exp(-C / T), which does not depend on the other dreams of the group; float64 [G].
    """

    safe: BoolArray
    cost_m2: Float64Array
    reward: Float64Array
    value: Float64Array

    @property
    def tells(self) -> bool:
        """Whether any dream is safe and comes to the goal region by a known way: otherwise nothing can be learned."""
        return bool((self.value > 0).any())


def score_dreams(
    reward_map: RewardMap,
    start_xy_m: Float64Array,
    paths_xy_m: Float64Array,
    expert_distance_m: Float64Array,
    config: RewardConfig,
) -> Scored:
    """Score a group.

    Args:
        reward_map: map and distance field of the query.
        start_xy_m: x_0, position of the query's frame; float64 [2].
        paths_xy_m: positions of the dreams after it; float64 [G, L, 2].
        expert_distance_m: distance D of the expert to the goal at the query's frame and at the L frames after it;
            float [L + 1].
        config: temperature and bonus.
    """
    paths = np.concatenate([np.broadcast_to(start_xy_m, (len(paths_xy_m), 1, 2)), paths_xy_m], axis=1)
    safe = footprints_are_free(reward_map.grid, paths, reward_map.robot_radius_m)
    cost = progress_cost_m2(reward_map.distance_m(paths), np.asarray(expert_distance_m, np.float64))
    reward, value = rewards(safe, cost, config)
    return Scored(safe=safe, cost_m2=cost, reward=reward, value=value)


def progress_cost_m2(distance_m: Float64Array, expert_distance_m: Float64Array) -> Float64Array:
    """C: mean over the steps of (progress - progress of the expert)^2, m^2; infinite without a distance.

    Args:
        distance_m: D along the dreams, [G, L + 1], m.
        expert_distance_m: D along the expert's way, [L + 1], m.
    """
    with np.errstate(invalid="ignore"):  # from nowhere to nowhere
        gained = distance_m[:, :-1] - distance_m[:, 1:]
    wanted = expert_distance_m[:-1] - expert_distance_m[1:]
    cost = np.mean((gained - wanted) ** 2, axis=1)
    return np.where(np.isfinite(cost), cost, np.inf)


def rewards(safe: BoolArray, cost_m2: Float64Array, config: RewardConfig) -> tuple[Float64Array, Float64Array]:
    """Rewards in a group, and what each dream is worth alone (equation of the reward; the bonus of spec/model.md 8).

    r = s exp(-C / T) / sum of s exp(-C / T). With C1 < C2 the least costs of safe dreams, the best gains
    clip((C2 - C1) / (C1 + T), 0, 1), at most up to 1; a safe dream alone gains 1. Zeros where no dream is safe.
    """
    known = safe & np.isfinite(cost_m2)
    value = np.where(known, np.exp(-np.where(known, cost_m2, 0.0) / config.temperature_m2), 0.0)
    if not known.any():
        return np.zeros(len(safe)), value
    lowest = np.min(cost_m2[known])  # taken out of the softmax: far from the expert all of its terms are 0
    shifted = np.where(known, np.exp(-(np.where(known, cost_m2, lowest) - lowest) / config.temperature_m2), 0.0)
    reward = shifted / shifted.sum()
    if config.bonus:
        order = np.sort(cost_m2[known])
        margin = 1.0 if len(order) == 1 else np.clip((order[1] - order[0]) / (order[0] + config.temperature_m2), 0, 1)
        best = int(np.argmin(np.where(known, cost_m2, np.inf)))
        reward[best] = min(1.0, reward[best] + margin)
    return reward, value


def dream_paths_m(
    T_world_camera: Float64Array, T_camera0_query: Float64Array, T_camera0_dream: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Where dreams lead, placed in the map by the true pose of the query's frame: start [2], paths [..., 2], m.

    Args:
        T_world_camera: true pose of the query's frame; float64 [4, 4].
        T_camera0_query: the same frame as the model estimates it; float64 [4, 4].
        T_camera0_dream: frames of the dreams as it estimates them; float64 [..., 4, 4].
    """
    T_world_dream = T_world_camera @ invert(T_camera0_query) @ T_camera0_dream
    return T_world_camera[:2, 3], T_world_dream[..., :2, 3]
