"""Success weighted by path length, in both of its public readings.

SPL (Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018) is the mean over episodes of
success * shortest / max(shortest, driven). The papers of the start-goal benchmark take the geodesic distance for the
shortest way, its public code the straight line: `spl_geodesic` and `spl_straight` are this one function of either.
"""


def weighted_success(success: bool, shortest_m: float, driven_m: float) -> float:
    """SPL of one episode, in [0, 1].

    Args:
        success: whether the episode succeeded.
        shortest_m: length of the shortest way from start to goal, m, positive.
        driven_m: length of the way that was driven, m; a robot that did not drive but succeeds counts as 1.

    Raises:
        ValueError: a length is negative, or not finite.
    """
    if not (0.0 < shortest_m < float("inf") and 0.0 <= driven_m < float("inf")):
        raise ValueError(f"lengths must be finite, and shortest_m positive, found {shortest_m} and {driven_m}")
    return shortest_m / max(shortest_m, driven_m) if success else 0.0
