"""Does the camera stand on the robot as its mount says?"""

from dataclasses import replace

import numpy as np

from wsm_data.checks.limits import verdict_within
from wsm_data.errors import Reason
from wsm_data.geometry.camera import T_STORED_OPENCV
from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.source.motion import CarriedBy
from wsm_data.schema.verdict import Verdict


def check_mount(record: EpisodeRecord, dataset: DatasetManifest) -> Verdict:
    """Refuse a mount outside its limits, or poses that are not those of a camera mounted so (`mount.misfit`).

    Where poses in other camera axes would be, the message names these.
    """
    verdict = _mount_verdict(record, record.T_world_camera, dataset)
    if verdict.keep:
        return verdict
    T_world_stored = record.T_world_camera @ invert(T_STORED_OPENCV[dataset.camera_axes])
    for axes in sorted(set(T_STORED_OPENCV) - {dataset.camera_axes}):
        if _mount_verdict(record, T_world_stored @ T_STORED_OPENCV[axes], dataset).keep:
            message = (
                f"{verdict.message}; it would stand so if the poses were stored as {axes} and not as "
                f"{dataset.camera_axes}: correct the manifest's camera_axes"
            )
            return replace(verdict, message=message, measured={**verdict.measured, "fits": axes})
    return verdict


def _mount_verdict(record: EpisodeRecord, T_world_camera: Float64Array, dataset: DatasetManifest) -> Verdict:
    checks = dataset.checks
    pitch_deg, roll_deg = _pitch_and_roll_deg(T_world_camera)
    mount_pitch_deg = float(np.rad2deg(record.camera_pitch_rad))
    disagreement_deg = float(np.abs(pitch_deg - mount_pitch_deg).max())
    limits = {
        "camera_height_m": (record.camera_height_m, checks.min_camera_height_m, dataset.max_camera_height_m),
        "mount_pitch_deg": (mount_pitch_deg, -checks.max_pitch_up_deg, dataset.max_pitch_deg),
        "roll_deg": (float(np.abs(roll_deg).max()), 0.0, checks.max_roll_deg),
    }
    if dataset.motion.carried_by == CarriedBy.ROBOT:  # a hand holds it otherwise in every frame
        limits["pitch_disagreement_deg"] = (disagreement_deg, 0.0, checks.max_pitch_disagreement_deg)
    return verdict_within(limits, Reason.MOUNT_MISFIT, f"{record.id.text}: the camera does not stand as its mount says")


def _pitch_and_roll_deg(T_world_camera: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Pitch down and roll of cameras [T, 4, 4] in a world with z up, degrees.

    With x right, y down and z forward the optical axis has z = -sin(pitch), and an upright camera's x axis is
    horizontal while its y axis points down.
    """
    right_z, down_z, forward_z = (T_world_camera[:, 2, axis] for axis in range(3))
    pitch = np.arcsin(np.clip(-forward_z, -1.0, 1.0))
    return np.rad2deg(pitch), np.rad2deg(np.arctan2(right_z, -down_z))
