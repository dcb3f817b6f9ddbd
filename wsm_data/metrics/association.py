"""Which time of one trajectory belongs to which of another."""

import numpy as np
from numpy.typing import NDArray

from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import Float64Array

MAX_DIFFERENCE_S = 0.01
"""Stamps farther apart than this do not belong together, s; as TUM's tools and evo have it."""


def associate(
    stamps_a_s: Float64Array, stamps_b_s: Float64Array, max_difference_s: float = MAX_DIFFERENCE_S
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pair the stamps of two trajectories: each of the shorter with the nearest of the longer.

    Of two stamps that are equally near the earlier one is taken, and of two trajectories of one length the first is
    the shorter. A stamp of the longer may be the nearest of several.

    Args:
        stamps_a_s: rising times, s; [A].
        stamps_b_s: rising times, s; [B].
        max_difference_s: pairs farther apart than this are left out, s.

    Returns:
        Indices into a and into b, both [N], N >= 1.

    Raises:
        DataError: `trajectory.unmatched` when no two stamps are near enough.
        ValueError: stamps do not rise.
    """
    for name, stamps in (("stamps_a_s", stamps_a_s), ("stamps_b_s", stamps_b_s)):
        if not (np.diff(stamps) > 0).all():
            raise ValueError(f"{name} must rise from one to the next")
    if len(stamps_b_s) < len(stamps_a_s):
        of_b, of_a = associate(stamps_b_s, stamps_a_s, max_difference_s)
        return of_a, of_b
    nearest = nearest_stamps(stamps_a_s, stamps_b_s) if len(stamps_a_s) else np.zeros(0, np.int64)
    near = np.flatnonzero(np.abs(stamps_b_s[nearest] - stamps_a_s) <= max_difference_s)
    if not len(near):
        raise DataError(
            Reason.TRAJECTORY_UNMATCHED,
            f"two trajectories must have stamps within {max_difference_s} s of one another, found none among "
            f"{len(stamps_a_s)} and {len(stamps_b_s)} stamps; are both in seconds, from the same clock?",
            {"stamps_a": len(stamps_a_s), "stamps_b": len(stamps_b_s)},
        )
    return near, nearest[near]


def nearest_stamps(wanted: Float64Array, stamps: Float64Array) -> NDArray[np.int64]:
    """Index of the stamp that is nearest to each wanted one; of two the earlier. Stamps rise, and there is one."""
    after = np.clip(np.searchsorted(stamps, wanted), 1, max(len(stamps) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(stamps) - 1)
    earlier = np.abs(wanted - stamps[before]) <= np.abs(stamps[after] - wanted)
    return np.where(earlier, before, after).astype(np.int64)
