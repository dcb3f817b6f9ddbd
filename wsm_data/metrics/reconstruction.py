"""Accuracy and completeness of a reconstruction: how far its points are from the true ones, and the reverse.

Three public definitions go under the same two words (means in centimetres, in metres, and the paper's root of the mean
square), so every number here says in its name which one it is.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from wsm_data.metrics.icp import IcpConfig, icp_rigid
from wsm_data.schema.arrays import Float64Array

_NEAR_M = 0.05
"""The distance of the completion ratio of Spann3R, CUT3R and NICER-SLAM, m."""


@dataclass(frozen=True, kw_only=True)
class ReconstructionErrors:
    """Distances between predicted and true points after alignment, m.

    Attributes:
        acc_rmse_m: predicted to nearest true point, root of the mean square; the paper's Acc.
        acc_mean_m: the same, mean.
        acc_median_m: the same, median.
        comp_mean_m: true to nearest predicted point, mean.
        comp_median_m: the same, median.
        comp_within_5cm: share of true points with a predicted one nearer than 0.05 m.
    """

    acc_rmse_m: float
    acc_mean_m: float
    acc_median_m: float
    comp_mean_m: float
    comp_median_m: float
    comp_within_5cm: float


def reconstruction_errors(
    predicted_m: Float64Array, true_m: Float64Array, icp: IcpConfig | None
) -> ReconstructionErrors:
    """Compare predicted points [N, 3] with true ones [M, 3].

    Args:
        predicted_m: already aligned by the Sim(3) of the camera centres (`metrics.trajectory`), m.
        true_m: back-projected true depth, m.
        icp: settings of the rigid refinement on top; None for none. It works on thinned clouds, while distances are
            measured between all points.

    Raises:
        DataError: `trajectory.degenerate`: no rigid refinement exists, since the clouds are too far apart.
    """
    refined = icp_rigid(predicted_m, true_m, icp).apply(predicted_m) if icp else predicted_m
    accuracy, _ = KDTree(true_m).query(refined)
    completeness, _ = KDTree(refined).query(true_m)
    return ReconstructionErrors(
        acc_rmse_m=float(np.sqrt(np.square(accuracy).mean())),
        acc_mean_m=float(accuracy.mean()),
        acc_median_m=float(np.median(accuracy)),
        comp_mean_m=float(completeness.mean()),
        comp_median_m=float(np.median(completeness)),
        comp_within_5cm=float((completeness < _NEAR_M).mean()),
    )
