"""Rigid alignment of point clouds without known correspondence, and thinning of clouds."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from wsm_data.geometry.alignment import IDENTITY, Similarity, align_points
from wsm_data.schema.arrays import Float64Array


@dataclass(frozen=True, kw_only=True)
class IcpConfig:
    """Settings of point-to-point ICP.

    Attributes:
        correspondence_m: points farther apart than this do not correspond, m.
        voxel_m: both clouds are thinned to one mean point in each cube of this side, m.
        max_iterations: it stops here at the latest.
        tolerance_m: it stops when no point of the source moves by more than this, m.
    """

    correspondence_m: float = 0.1
    voxel_m: float = 0.02
    max_iterations: int = 100
    tolerance_m: float = 1e-6

    def __post_init__(self) -> None:
        for name in ("correspondence_m", "voxel_m", "max_iterations", "tolerance_m"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, found {getattr(self, name)}")


def icp_rigid(source_m: Float64Array, target_m: Float64Array, config: IcpConfig) -> Similarity:
    """The rigid map that lays `source_m` [N, 3] on `target_m` [M, 3], from the identity on (Besl and McKay 1992).

    In turn each point of the source is paired with the nearest of the target, and the pairs are aligned.

    Raises:
        DataError: `trajectory.degenerate` when fewer than three pairs lie within `correspondence_m`, or on one line.
    """
    source, target = thin_cloud(source_m, config.voxel_m), thin_cloud(target_m, config.voxel_m)
    tree = KDTree(target)
    total, moved = IDENTITY, source
    for _ in range(config.max_iterations):
        distances, nearest = tree.query(moved, distance_upper_bound=config.correspondence_m)
        paired = np.isfinite(distances)
        step = align_points(moved[paired], target[nearest[paired]], with_scale=False)
        after = step.apply(moved)
        total = step.after(total)
        largest = float(np.linalg.norm(after - moved, axis=1).max())
        moved = after
        if largest <= config.tolerance_m:
            break
    return total


def thin_cloud(points_m: Float64Array, voxel_m: float) -> Float64Array:
    """One point for each cube of side `voxel_m` that holds points [N, 3]: their mean; ordered by cube."""
    cubes = np.floor(points_m / voxel_m).astype(np.int64)
    _, owner, counts = np.unique(cubes, axis=0, return_inverse=True, return_counts=True)
    sums = [np.bincount(owner.ravel(), weights=points_m[:, axis]) for axis in range(3)]
    return np.stack(sums, axis=1) / counts[:, None]
