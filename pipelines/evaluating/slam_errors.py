"""Errors of an estimate, and of many: means over scenes with intervals."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from pipelines.evaluating.slam_sequence import Reconstruction
from wsm_data.errors import DataError
from wsm_data.metrics.association import associate
from wsm_data.metrics.bootstrap import estimate_over_scenes
from wsm_data.metrics.icp import IcpConfig
from wsm_data.metrics.reconstruction import ReconstructionErrors, reconstruction_errors
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m, ate_sim3
from wsm_data.schema.arrays import Float64Array

METRICS = (
    "ate_rmse_sim3_m",
    "ate_rmse_unaligned_m",
    "acc_rmse_m",
    "acc_mean_m",
    "acc_median_m",
    "comp_mean_m",
    "comp_median_m",
    "comp_within_5cm",
)


@dataclass(frozen=True, kw_only=True)
class SequenceErrors:
    """Errors on one sequence; None where it has none, for the reason in `refused`.

    Attributes:
        key: of the clip.
        scene: its scene.
        poses: estimated poses that belong to a true one.
        ate_rmse_unaligned_m: camera centres as they are.
        ate_rmse_sim3_m: after Sim(3) alignment of the centres.
        reconstruction: of points after that alignment and rigid ICP.
        refused: reason code; empty where all was measured.
    """

    key: str
    scene: str
    poses: int = 0
    ate_rmse_unaligned_m: float | None = None
    ate_rmse_sim3_m: float | None = None
    reconstruction: ReconstructionErrors | None = None
    refused: str = ""

    @property
    def values(self) -> dict[str, float | None]:
        """Every metric by name."""
        points = asdict(self.reconstruction) if self.reconstruction else {}
        known = {**points, "ate_rmse_sim3_m": self.ate_rmse_sim3_m, "ate_rmse_unaligned_m": self.ate_rmse_unaligned_m}
        return {name: known.get(name) for name in METRICS}


def sequence_errors(key: str, scene: str, estimated: Reconstruction, true: Reconstruction) -> SequenceErrors:
    """Compare an estimate with the truth, as far as that goes: what cannot be measured is refused by its reason."""
    found: dict[str, object] = {}
    try:
        mine, theirs = associate(estimated.trajectory.stamps_s, true.trajectory.stamps_s)
        centres, truth = estimated.trajectory.centres_m[mine], true.trajectory.centres_m[theirs]
        found |= {"poses": len(mine), "ate_rmse_unaligned_m": ate_rmse_unaligned_m(centres, truth)}
        aligned = ate_sim3(centres, truth)
        found["ate_rmse_sim3_m"] = aligned.rmse_m
        predicted = aligned.alignment.apply(np.asarray(estimated.cloud.xyz_m, np.float64))
        true_points = np.asarray(true.cloud.xyz_m, np.float64)
        found["reconstruction"] = reconstruction_errors(predicted, true_points, IcpConfig())
    except DataError as error:
        found["refused"] = error.reason.value
    return SequenceErrors(key=key, scene=scene, **found)  # type: ignore[arg-type]


def compared_centres(estimated: Reconstruction, true: Reconstruction) -> dict[str, Float64Array]:
    """Camera centres [T, 3] in m, of what can be compared: `true`, `estimated, as it is`, `estimated, aligned`."""
    found = {"true": true.trajectory.centres_m}
    try:
        mine, theirs = associate(estimated.trajectory.stamps_s, true.trajectory.stamps_s)
        centres = estimated.trajectory.centres_m[mine]
        found["estimated, as it is"] = centres
        found["estimated, aligned"] = ate_sim3(centres, found["true"][theirs]).alignment.apply(centres)
    except DataError:
        pass  # `sequence_errors` says the reason
    return found


def summarise(errors: Sequence[SequenceErrors], seed: int) -> Mapping[str, object]:
    """Means over scenes with intervals by metric, None where no sequence has it, and what was refused."""
    record: dict[str, object] = {
        "sequences": len(errors),
        "refused": dict(sorted(Counter(one.refused for one in errors if one.refused).items())),
    }
    for name in METRICS:
        known = [(one.values[name], one.scene) for one in errors if one.values[name] is not None]
        values = np.array([value for value, _ in known], np.float64)
        record[name] = (
            asdict(estimate_over_scenes(values, [scene for _, scene in known], seed)) | {"sequences": len(known)}
            if known
            else None
        )
    return record
