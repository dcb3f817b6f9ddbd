"""Do the depth images of a trajectory fit its poses? Looked at in a few frames, at their stored size."""

import numpy as np

from pipelines.gate import require_kept
from wsm_data.checks.depth_agreement import check_depth_agreement
from wsm_data.codecs.images import decode_depth
from wsm_data.readers.frames import EpisodeFrames
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.episode import EpisodeRecord

SPACING_M = 0.5
"""Distance along the path between the frames that are compared: wrong axes show, and most of the view is shared."""

MAX_FRAMES = 7


def require_depth_agreement(record: EpisodeRecord, frames: EpisodeFrames, dataset: DatasetManifest) -> None:
    """Refuse a trajectory whose depth contradicts its poses.

    Raises:
        DataError: `pose.depth_disagree`, naming the camera axes that would fit; or a frame does not decode.
    """
    depth_m = {
        number: _depth_m(frames.depth[number], dataset.depth, f"{record.id.text}, depth frame {number}")
        for number in spaced_frames(record)
    }
    require_kept(check_depth_agreement(record, depth_m, dataset.camera_axes))


def spaced_frames(record: EpisodeRecord, spacing_m: float = SPACING_M, limit: int = MAX_FRAMES) -> tuple[int, ...]:
    """The first frames of a trajectory that lie `spacing_m` apart along the path, at most `limit`, in time order."""
    steps_m = np.linalg.norm(np.diff(record.T_world_camera[:, :3, 3], axis=0), axis=1)
    travelled_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    targets_m = np.arange(limit) * spacing_m
    reached = np.searchsorted(travelled_m, targets_m[targets_m <= travelled_m[-1]])
    return tuple(int(number) for number in np.unique(reached))


def _depth_m(data: bytes, encoding: DepthEncoding, where: str) -> Float32Array:
    raw = decode_depth(data, where)
    depth_m = raw.astype(np.float32) * np.float32(encoding.metres_per_unit)
    depth_m[np.isin(raw, encoding.invalid_codes)] = 0
    return depth_m
