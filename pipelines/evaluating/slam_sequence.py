"""A sequence to be estimated, with its truth, and an estimate of it: poses of its frames, and points."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipelines.evaluating.keyframe_points import POINTS_FOLDER, read_keyframe_points
from wsm_data.clips.decoded import DecodedVideo, valid_cells
from wsm_data.codecs.ply import ply_bytes
from wsm_data.errors import ConfigError, DataError, Reason
from wsm_data.files.atomic import write_bytes
from wsm_data.geometry.camera import pixel_rays
from wsm_data.geometry.transform import transform_points, transforms_from_vectors
from wsm_data.metrics.tum import StampedTrajectory, read_tum, write_tum
from wsm_data.readers.ply import read_point_cloud, require_finite_points
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array, Uint8Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.sequence import TEMPORAL_RATIO

TRAJECTORY_FILES = ("trajectory.txt", "final_traj.txt")
CLOUD_FILES = ("cloud.ply", "final.ply", POINTS_FOLDER)
"""As they are written here, and as SLAM-Former leaves them; the first that is there counts, for it leaves two."""

MAX_DEPTH_M = 5.0
"""What is farther is no point, neither of the truth nor of an estimate."""
_EVERY_PX = 4


@dataclass(frozen=True, kw_only=True)
class Reconstruction:
    """Poses of frames, and points.

    Attributes:
        trajectory: its stamps are numbers of frames.
        cloud: in the frame that the poses stand in.
    """

    trajectory: StampedTrajectory
    cloud: PointCloud


def shown_frames(clip: Clip) -> range:
    """The last frame of each latent; still frames that were added to the clip are left out."""
    return range(0, clip.meta.recorded_frames, TEMPORAL_RATIO)


def true_reconstruction(clip: Clip, decoded: DecodedVideo) -> Reconstruction:
    """The truth of a clip in the first camera's frame: its recorded frames, and the points of its measured depth.

    Depth is what the stored latents decode to, where every pixel of a latent's cell was measured.

    Args:
        clip: the clip.
        decoded: its `shown_frames`.

    Raises:
        ConfigError: the clip has no depth.
    """
    if not clip.has_depth:
        raise ConfigError(
            f"sequences must have depth to hold a reconstruction against, and {clip.meta.key} has none: its source has "
            "none; evaluate a release with depth"
        )
    measured = valid_cells(clip, decoded.frames) == np.iinfo(np.uint8).max
    ratio = decoded.rgb.shape[1] // measured.shape[1]
    seen = measured.repeat(ratio, axis=1).repeat(ratio, axis=2)
    return reconstruction(clip, decoded, decoded.depth_m, clip.poses.astype(np.float64), seen)


def reconstruction(
    clip: Clip, decoded: DecodedVideo, depth_m: Float32Array, poses: Float64Array, seen: BoolArray | None
) -> Reconstruction:
    """Poses of a clip's frames, and depth of some of them, as a trajectory and points.

    One pixel in four either way gives a point.

    Args:
        clip: gives the camera.
        decoded: gives colours, of its `shown_frames`.
        depth_m: of these frames, estimated or true; [N, H, W], m.
        poses: of all frames, likewise; [T, 7].
        seen: pixels [N, H, W] that have a depth; None for all.
    """
    recorded = clip.meta.recorded_frames
    T_camera0_camera = transforms_from_vectors(poses[:recorded])
    rays = pixel_rays(clip.intrinsics)
    kept = depth_m <= MAX_DEPTH_M
    if seen is not None:
        kept &= seen
    parts = [
        _points(depth_m[number], decoded.rgb[number], kept[number], rays, T_camera0_camera[frame])
        for number, frame in enumerate(decoded.frames)
    ]
    points, colours = (np.concatenate(some) for some in zip(*parts, strict=True))
    return Reconstruction(
        trajectory=StampedTrajectory(stamps_s=np.arange(recorded, dtype=np.float64), T_world_camera=T_camera0_camera),
        cloud=PointCloud(xyz_m=points.astype(np.float32), rgb_u8=colours),
    )


def _points(
    depth_m: Float32Array, rgb_u8: Uint8Array, kept: BoolArray, rays: Float64Array, T_camera0_camera: Float64Array
) -> tuple[Float64Array, Uint8Array]:
    thin = (slice(None, None, _EVERY_PX),) * 2
    chosen = kept[thin]
    points = (rays[thin] * depth_m[thin][..., None])[chosen]
    return transform_points(T_camera0_camera, points), rgb_u8[thin][chosen]


def write_reconstruction(folder: Path, found: Reconstruction) -> None:
    """Write a trajectory in TUM's format and points as PLY."""
    write_tum(folder / TRAJECTORY_FILES[0], found.trajectory)
    write_bytes(folder / CLOUD_FILES[0], ply_bytes(found.cloud))


def read_reconstruction(folder: Path) -> Reconstruction:
    """Read what `write_reconstruction`, or another system under its own names, wrote.

    Raises:
        DataError: a file is missing, or is none of its kind.
    """
    trajectory = read_tum(_one_of(folder, TRAJECTORY_FILES, Reason.TRAJECTORY_UNREADABLE))
    found = _one_of(folder, CLOUD_FILES, Reason.CLOUD_MISSING)
    cloud = read_keyframe_points(found) if found.is_dir() else read_point_cloud(found)
    require_finite_points(cloud)
    return Reconstruction(trajectory=trajectory, cloud=cloud)


def _one_of(folder: Path, names: tuple[str, ...], reason: Reason) -> Path:
    found = [folder / name for name in names if (folder / name).exists()]
    if not found:
        message = f"{folder} must hold one of {', '.join(names)}, found none; put the estimate there"
        raise DataError(reason, message, {"folder": folder})
    return found[0]
