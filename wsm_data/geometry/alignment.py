"""Rigid and similarity alignment of corresponding points."""

from dataclasses import dataclass

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import Float64Array, frozen_array, require_array

_RANK_TOLERANCE = 1e-12
"""A singular value of the covariance below this share of the larger extent of the two sets counts as zero."""


@dataclass(frozen=True, kw_only=True)
class Similarity:
    """The map p -> c R p + t.

    Attributes:
        scale: c, positive; 1 for a rigid transform.
        rotation: R, float64 [3, 3].
        translation_m: t, float64 [3].
    """

    scale: float
    rotation: Float64Array
    translation_m: Float64Array

    def __post_init__(self) -> None:
        require_array("rotation", self.rotation, np.float64, (3, 3))
        require_array("translation_m", self.translation_m, np.float64, (3,))
        for name in ("rotation", "translation_m"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))

    def apply(self, points_m: Float64Array) -> Float64Array:
        """Map points [..., 3]."""
        return self.scale * (np.asarray(points_m, np.float64) @ self.rotation.T) + self.translation_m

    def after(self, first: "Similarity") -> "Similarity":
        """The map that applies `first`, then this one."""
        return Similarity(
            scale=self.scale * first.scale,
            rotation=self.rotation @ first.rotation,
            translation_m=self.apply(first.translation_m),
        )


IDENTITY = Similarity(scale=1.0, rotation=np.eye(3), translation_m=np.zeros(3))
"""The map that changes nothing."""


def align_points(source_m: Float64Array, target_m: Float64Array, *, with_scale: bool) -> Similarity:
    """The map of `source_m` onto `target_m` with the least sum of squared distances.

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991, equations
    34 to 43: with the covariance (1/n) sum (y - ym)(x - xm)^T = U D V^T and S = diag(1, 1, sign(det U det V)),
    R = U S V^T, c = tr(D S) / var(x) and t = ym - c R xm.

    Args:
        source_m: x, float64 [N, 3].
        target_m: y, the point that each x corresponds to; float64 [N, 3].
        with_scale: whether c is estimated (Sim(3)) or 1 (SE(3)).

    Raises:
        DataError: `trajectory.degenerate`: all points of a set lie on one line, or in one place, so that a rotation
            about it is undetermined.
        ValueError: the sets differ in size.
    """
    require_array("source_m", source_m, np.float64, (None, 3))
    require_array("target_m", target_m, np.float64, (len(source_m), 3))
    if len(source_m) < 3:
        raise _degenerate(f"found {len(source_m)}", len(source_m))
    source_mean, target_mean = source_m.mean(axis=0), target_m.mean(axis=0)
    x, y = source_m - source_mean, target_m - target_mean
    u, d, vt = np.linalg.svd(y.T @ x / len(x))
    extent = float(np.sqrt(np.square(x).sum(axis=1).mean() * np.square(y).sum(axis=1).mean()))
    if np.count_nonzero(d > _RANK_TOLERANCE * extent) < 2:
        raise _degenerate(f"found {len(x)} whose covariance has the singular values {d.tolist()}", len(x))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * signs) @ vt
    scale = float((d * signs).sum() / np.square(x).sum(axis=1).mean()) if with_scale else 1.0
    return Similarity(scale=scale, rotation=rotation, translation_m=target_mean - scale * rotation @ source_mean)


def _degenerate(found: str, points: int) -> DataError:
    return DataError(
        Reason.TRAJECTORY_DEGENERATE,
        f"an alignment needs at least three pairs of points that do not lie on one line, {found}; report the error "
        "without alignment",
        {"points": points},
    )
