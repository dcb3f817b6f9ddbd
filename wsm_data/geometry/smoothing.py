"""Poses without the jitter that changes from one to the next."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def smoothed_poses(T_world_camera: Float64Array, reach: int) -> Float64Array:
    """The mean of every pose and of those up to `reach` frames before and after it, as far as both sides have them.

    A mean of rotations is the rotation nearest to the mean of their matrices (the chordal mean: Hartley, Trumpf, Dai
    and Li, "Rotation averaging", IJCV 2013, section 5.3).

    Args:
        T_world_camera: poses in time order; float64 [T, 4, 4].
        reach: 0 leaves them as they are; the first and the last pose stay in any case.
    """
    number = np.arange(len(T_world_camera))
    reaches = np.minimum(reach, np.minimum(number, number[::-1]))
    sums = np.concatenate([np.zeros((1, 4, 4)), np.cumsum(T_world_camera, axis=0)])
    means = (sums[number + reaches + 1] - sums[number - reaches]) / (2 * reaches + 1)[:, None, None]
    left, _, right = np.linalg.svd(means[:, :3, :3])
    smoothed: Float64Array = np.tile(np.eye(4), (len(means), 1, 1))
    smoothed[:, :3, :3] = left @ right
    smoothed[:, :3, 3] = means[:, :3, 3]
    return smoothed
