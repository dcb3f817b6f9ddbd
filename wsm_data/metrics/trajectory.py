"""Absolute trajectory error, with and without alignment: the names say which."""

from dataclasses import dataclass

import numpy as np

from wsm_data.geometry.alignment import Similarity, align_points
from wsm_data.schema.arrays import Float64Array


@dataclass(frozen=True, kw_only=True)
class AlignedError:
    """Error of a trajectory after it was laid over the true one.

    Attributes:
        rmse_m: root of the mean squared distance of camera centres, m.
        alignment: the map from the estimate's frame to the true one.
    """

    rmse_m: float
    alignment: Similarity


def ate_rmse_unaligned_m(estimated_m: Float64Array, true_m: Float64Array) -> float:
    """Absolute trajectory error of camera centres [T, 3] as they are: root of the mean squared distance, m.

    For estimates that are metric and in the frame of the truth, such as the first camera's; nothing is aligned.
    """
    if estimated_m.shape != true_m.shape or not len(true_m):
        raise ValueError(f"both must be [T, 3] with T >= 1, found {estimated_m.shape} and {true_m.shape}")
    return float(np.sqrt(np.square(np.asarray(estimated_m, np.float64) - true_m).sum(axis=-1).mean()))


def ate_sim3(estimated_m: Float64Array, true_m: Float64Array) -> AlignedError:
    """Absolute trajectory error of camera centres [T, 3] after Sim(3) alignment (Umeyama), as the paper reports it.

    Raises:
        DataError: `trajectory.degenerate` when all centres lie on one line.
    """
    return _aligned(estimated_m, true_m, with_scale=True)


def sim3_residual_m(estimated_m: Float64Array, true_m: Float64Array) -> float:
    """`ate_sim3(...).rmse_m` where the alignment is determined, and defined where it is not, as on a straight way.

    What is left after the best similarity follows from singular values alone (Umeyama 1991, equation 33), also where
    a turn about the line that all centres lie on changes nothing.
    """
    estimated, true = (np.asarray(one, np.float64) - np.mean(one, axis=0) for one in (estimated_m, true_m))
    spread_true, spread = (float(np.square(one).sum(axis=1).mean()) for one in (true, estimated))
    if not spread:
        return float(np.sqrt(spread_true))
    left, singular, right = np.linalg.svd(true.T @ estimated / len(true))
    singular[-1] *= np.sign(np.linalg.det(left) * np.linalg.det(right))
    return float(np.sqrt(max(0.0, spread_true - singular.sum() ** 2 / spread)))


def ate_se3(estimated_m: Float64Array, true_m: Float64Array) -> AlignedError:
    """Absolute trajectory error of camera centres [T, 3] after rigid alignment.

    Raises:
        DataError: `trajectory.degenerate` when all centres lie on one line.
    """
    return _aligned(estimated_m, true_m, with_scale=False)


def _aligned(estimated_m: Float64Array, true_m: Float64Array, *, with_scale: bool) -> AlignedError:
    estimated, true = np.asarray(estimated_m, np.float64), np.asarray(true_m, np.float64)
    alignment = align_points(estimated, true, with_scale=with_scale)
    return AlignedError(rmse_m=ate_rmse_unaligned_m(alignment.apply(estimated), true), alignment=alignment)
