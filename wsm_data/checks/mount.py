"""Does the camera stand on the robot as its mount says?"""

from dataclasses import dataclass

import numpy as np

from wsm_data.checks.limits import verdict_within
from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class MountConfig:
    """What a mount may be, beside the manifest's greatest height and pitch.

    Attributes:
        min_height_m: lowest camera, m.
        max_pitch_up_deg: a level mount may point up by so much, degrees: calibration, not intent.
        max_disagreement_deg: between the mount's pitch and that of any pose, degrees; the robot drives on flat floors.
        max_roll_deg: of any pose, degrees. Poses in the wrong camera axes are upside down.
    """

    min_height_m: float = 0.05
    max_pitch_up_deg: float = 2.0
    max_disagreement_deg: float = 3.0
    max_roll_deg: float = 5.0


def check_mount(record: EpisodeRecord, dataset: DatasetManifest, config: MountConfig | None = None) -> Verdict:
    """Refuse a mount outside its limits, or poses that are not those of a camera mounted so (`mount.misfit`)."""
    config = config or MountConfig()
    pitch_deg, roll_deg = _pitch_and_roll_deg(record.T_world_camera)
    mount_pitch_deg = float(np.rad2deg(record.camera_pitch_rad))
    limits = {
        "camera_height_m": (record.camera_height_m, config.min_height_m, dataset.max_camera_height_m),
        "mount_pitch_deg": (mount_pitch_deg, -config.max_pitch_up_deg, dataset.max_pitch_deg),
        "pitch_disagreement_deg": (float(np.abs(pitch_deg - mount_pitch_deg).max()), 0.0, config.max_disagreement_deg),
        "roll_deg": (float(np.abs(roll_deg).max()), 0.0, config.max_roll_deg),
    }
    return verdict_within(limits, Reason.MOUNT_MISFIT, f"{record.id.text}: the camera does not stand as its mount says")


def _pitch_and_roll_deg(T_world_camera: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Pitch down and roll of cameras [T, 4, 4] in a world with z up, degrees.

    With x right, y down and z forward the optical axis has z = -sin(pitch), and an upright camera's x axis is
    horizontal while its y axis points down.
    """
    right_z, down_z, forward_z = (T_world_camera[:, 2, axis] for axis in range(3))
    pitch = np.arcsin(np.clip(-forward_z, -1.0, 1.0))
    return np.rad2deg(pitch), np.rad2deg(np.arctan2(right_z, -down_z))
