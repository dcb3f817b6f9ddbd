"""The first pass over a sequence: which images belong together, where they were taken, and which of them are kept."""

from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.association import nearest_stamps
from wsm_data.readers.frames_digest import ABSENT
from wsm_data.readers.recorded import Recording, image_size, scan_recording
from wsm_data.readers.source import Container, ContainerScan
from wsm_data.readers.thinning import moving_frames
from wsm_data.readers.tum.camera import camera_name, read_intrinsics
from wsm_data.readers.tum.listing import StampedFiles, read_listing
from wsm_data.readers.tum.poses import poses_at, read_poses
from wsm_data.readers.tum.sequences import folder_of
from wsm_data.schema.arrays import Float64Array, Int64Array
from wsm_data.schema.dataset import DatasetManifest


def scan_sequence(source: Path, container: Container, dataset: DatasetManifest, sample_every: int) -> ContainerScan:
    """Read a sequence: lists, poses and camera, then the images that are kept.

    Raises:
        DataError: the sequence as a whole cannot be used: a `sequence.*` reason, or those of its poses and camera.
    """
    folder = folder_of(source, container)
    recording = read_recording(folder, container.id, dataset)
    return scan_recording(folder, recording, dataset, sample_every)


def read_recording(folder: Path, container: str, dataset: DatasetManifest) -> Recording:
    """What a sequence says of its frames; of its images only the first is opened, for its size.

    Raises:
        DataError: as `scan_sequence`.
    """
    files = dataset.files
    rgb = read_listing(folder, files.rgb, container)
    depth = read_listing(folder, files.depth, container) if files.depth else None
    of_rgb, of_depth = _all_of(rgb) if depth is None else mutual_pairs(rgb, depth, files.max_depth_lag_s)
    trajectory = read_poses(folder, files, dataset.camera_axes, container)
    T_world_camera, known = poses_at(trajectory, rgb.stamps_s[of_rgb], files.max_pose_gap_s)
    if not known.any():
        raise _unassociated(container, rgb, depth, trajectory.stamps_s, dataset)
    kept = np.flatnonzero(known)
    kept = kept[moving_frames(T_world_camera[kept], dataset.motion)]
    scene = folder.resolve().name
    camera = camera_name(scene, dataset)
    names = tuple(rgb.names[i] for i in of_rgb[kept])
    size = image_size(folder, names[0], container)
    return Recording(
        container=container,
        group=f"{dataset.name}_{camera}",
        scene=scene,
        rgb=names,
        depth=(ABSENT,) * len(names) if depth is None else tuple(depth.names[i] for i in of_depth[kept]),
        T_world_camera=T_world_camera[kept],
        intrinsics=read_intrinsics(folder, camera, size, dataset, container),
        notes=(Reason.SEQUENCE_UNASSOCIATED.value,) if known.sum() < len(rgb.names) else (),
    )


def mutual_pairs(rgb: StampedFiles, depth: StampedFiles, max_lag_s: float) -> tuple[Int64Array, Int64Array]:
    """Colour and depth images that are each the other's nearest in time, and at most `max_lag_s` apart.

    So no depth image is used twice, whatever the rates of the two are.

    Returns:
        Indices into both lists, int64 [N], rising.
    """
    to_depth = nearest_stamps(rgb.stamps_s, depth.stamps_s)
    back = nearest_stamps(depth.stamps_s, rgb.stamps_s)[to_depth]
    lag_s = np.abs(depth.stamps_s[to_depth] - rgb.stamps_s)
    of_rgb = np.flatnonzero((back == np.arange(len(rgb.names))) & (lag_s <= max_lag_s))
    return of_rgb, to_depth[of_rgb]


def _all_of(rgb: StampedFiles) -> tuple[Int64Array, Int64Array]:
    every = np.arange(len(rgb.names))
    return every, every


def _unassociated(
    container: str, rgb: StampedFiles, depth: StampedFiles | None, poses_s: Float64Array, dataset: DatasetManifest
) -> DataError:
    spans = {"rgb": rgb.stamps_s[[0, -1]].tolist(), "poses": poses_s[[0, -1]].tolist()}
    if depth is not None:
        spans["depth"] = depth.stamps_s[[0, -1]].tolist()
    return DataError(
        Reason.SEQUENCE_UNASSOCIATED,
        f"{container}: images need depth within {dataset.files.max_depth_lag_s} s and two poses around it within "
        f"{dataset.files.max_pose_gap_s} s, and none has; times go from and to {spans}: are they of one clock?",
        spans,
    )
