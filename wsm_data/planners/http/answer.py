"""Plans as the JSON of an answer, and back."""

import json
from collections.abc import Sequence

import numpy as np

from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.wire import read_numbers, read_object
from wsm_data.planners.planner import Plan
from wsm_data.schema.arrays import Float64Array

TRAJECTORY, ALL_TRAJECTORIES, ALL_VALUES = "trajectory", "all_trajectory", "all_values"
GOAL_ESTIMATE = "sub_pointgoal_pd"
"""The one key that clients of start goals need, and those of point goals must not be given."""


def encode_answer(plans: Sequence[Plan], goal_estimates_m: Float64Array | None) -> bytes:
    """The answer for all environments of a batch.

    Numbers stand in rectangular arrays: a shorter path stays at its last point, a point without a third number has
    zero, a plan with fewer candidates has its last one again, and one without any has its path, of value 0.

    Args:
        plans: of each environment.
        goal_estimates_m: where each believes its goal to be, [B, 3], for clients of start goals.
    """
    candidates = [_with_three(plan.path_m[None] if plan.candidates_m is None else plan.candidates_m) for plan in plans]
    values = [
        np.zeros(len(ways)) if plan.values is None else plan.values
        for plan, ways in zip(plans, candidates, strict=True)
    ]
    most, longest = max(len(ways) for ways in candidates), max(ways.shape[1] for ways in candidates)
    record = {
        TRAJECTORY: _rectangular([_with_three(plan.path_m) for plan in plans]).tolist(),
        ALL_TRAJECTORIES: np.stack([_padded(_padded(ways, 1, longest), 0, most) for ways in candidates]).tolist(),
        ALL_VALUES: np.stack([_padded(one, 0, most) for one in values]).tolist(),
    }
    if goal_estimates_m is not None:
        record[GOAL_ESTIMATE] = goal_estimates_m.tolist()
    return json.dumps(record).encode()


def decode_answer(text: bytes, batch: int) -> list[Plan]:
    """Inverse of `encode_answer`, of any public planner's answer.

    Candidates and values are for pictures alone and differ in shape between planners: those that are not
    [B, N, T, 2 or 3] and [B, N] are left out.

    Raises:
        WireError: `malformed`, `not_finite`, or `wrong_batch`.
    """
    record = read_object(text, "the answer")
    paths = read_numbers(record, TRAJECTORY, (batch, None, None))
    if paths.shape[1] < 2 or paths.shape[2] < 2:
        raise WireError(Fault.MALFORMED, f"{TRAJECTORY} must be [B, T >= 2, 2 or 3], found {list(paths.shape)}")
    goals = read_numbers(record, GOAL_ESTIMATE, (batch, 3)) if GOAL_ESTIMATE in record else None
    try:
        candidates = read_numbers(record, ALL_TRAJECTORIES, (batch, None, None, None))[..., :3]
        values = read_numbers(record, ALL_VALUES, (batch, candidates.shape[1]))
    except WireError:
        candidates, values = None, None
    return [
        Plan(
            path_m=paths[number, :, :3],
            candidates_m=None if candidates is None else candidates[number],
            values=None if values is None else values[number],
            goal_estimate_m=None if goals is None else goals[number],
        )
        for number in range(batch)
    ]


def _with_three(points: Float64Array) -> Float64Array:
    missing = [(0, 0)] * (points.ndim - 1) + [(0, 3 - points.shape[-1])]
    return np.pad(points, missing)


def _rectangular(paths: Sequence[Float64Array]) -> Float64Array:
    longest = max(len(path) for path in paths)
    return np.stack([_padded(path, 0, longest) for path in paths])


def _padded(array: Float64Array, axis: int, length: int) -> Float64Array:
    """The last entry along an axis, again until there are `length`."""
    amounts = [(0, 0)] * array.ndim
    amounts[axis] = (0, length - array.shape[axis])
    return np.pad(array, amounts, mode="edge")
