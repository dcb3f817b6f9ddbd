"""The source that `wsm_data.readers.arrays` writes."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from wsm_data.errors import ConfigError, DataError, Reason
from wsm_data.readers.arrays import EPISODE_FILE
from wsm_data.readers.folder_signature import folder_signature
from wsm_data.readers.frames_digest import ABSENT
from wsm_data.readers.recorded import Recording, image_size, iter_recorded, scan_recording
from wsm_data.readers.source import Container, ContainerScan, SourceReader
from wsm_data.readers.thinning import moving_frames
from wsm_data.readers.tum.poses import require_rigid
from wsm_data.readers.unreadable import read_file
from wsm_data.schema.arrays import require_finite
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.verdict import Refusal

EXPECTS = f"<scene>/<episode>/{EPISODE_FILE} with rgb/, and depth/ where there is depth, beside it"

_LAYOUT = "scene"


def _find_containers(source: Path, dataset: DatasetManifest) -> list[Container]:
    """Every scene: a folder with a folder that holds an episode's file."""
    scenes = sorted({path.parent.parent for path in source.glob(f"*/*/{EPISODE_FILE}")})
    if not scenes:
        raise ConfigError(
            f"the source of data set {dataset.name!r} must hold {EXPECTS}, none is below {source}; the source "
            "is the folder that was given to write_episode"
        )
    return [Container(id=scene.name, layout=_LAYOUT, signature=folder_signature(scene)) for scene in scenes]


def _scan(source: Path, container: Container, dataset: DatasetManifest, sample_every: int) -> ContainerScan:
    scene = source / container.id
    scans, refusals = [], []
    for episode in sorted(path.parent.name for path in scene.glob(f"*/{EPISODE_FILE}")):
        try:
            recording, floor_z_m = _read_recording(scene, container.id, episode, dataset)
            own = replace(dataset, motion=replace(dataset.motion, floor_z_m=floor_z_m))
            scans.append(scan_recording(scene, recording, own, sample_every))
        except DataError as error:
            refusals.append(Refusal.from_error(f"{dataset.name}/{container.id}/{episode}", container.id, error))
    return ContainerScan(
        records=tuple(chain.from_iterable(scan.records for scan in scans)),
        refusals=(*refusals, *chain.from_iterable(scan.refusals for scan in scans)),
        cloud=None,
        cloud_refusal=None,
        depth_samples={text: samples for scan in scans for text, samples in scan.depth_samples.items()},
        bytes_read=sum(scan.bytes_read for scan in scans),
    )


def _read_recording(
    scene: Path, container: str, episode: str, dataset: DatasetManifest
) -> tuple[Recording, float | None]:
    where = f"{container}:{episode}/{EPISODE_FILE}"
    try:
        said = json.loads(read_file(str(scene / episode / EPISODE_FILE), where))
        T_world_camera = np.array(said["T_world_camera"], np.float64).reshape(-1, 4, 4)
        K = np.array(said["K"], np.float64).reshape(3, 3)
        width, height = image_size(scene, f"{episode}/rgb/000000.png", container)
        intrinsics = Intrinsics(fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2], width=width, height=height)
        camera, floor, goal = _name(said["camera"]), said["floor_z_m"], said["goal_world_m"]
        goal_world_m, with_depth = None if goal is None else _point(goal), bool(said["depth"])
        floor_z_m = dataset.motion.floor_z_m if floor is None else float(floor)
        require_finite("floor_z_m", np.array(floor_z_m or 0.0))
        if not len(T_world_camera):
            raise ValueError("T_world_camera must hold a pose, found none")
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataError(
            Reason.SEQUENCE_UNREADABLE,
            f"{where} must be as write_episode wrote it, but {error}; write it again",
        ) from error
    if not np.isfinite(T_world_camera).all():
        frame = int(np.flatnonzero(~np.isfinite(T_world_camera).all(axis=(1, 2)))[0])
        raise DataError(
            Reason.POSE_NOT_FINITE, f"{where}: poses must be finite, that of frame {frame} is not; write it again"
        )
    require_rigid(T_world_camera, "T_world_camera", where)
    kept = moving_frames(T_world_camera, dataset.motion).tolist()
    recording = Recording(
        container=container,
        group=f"{dataset.name}_{camera}",
        scene=container,
        episode=episode,
        rgb=tuple(f"{episode}/rgb/{i:06d}.png" for i in kept),
        depth=tuple(f"{episode}/depth/{i:06d}.png" if with_depth else ABSENT for i in kept),
        T_world_camera=T_world_camera[kept],
        intrinsics=intrinsics,
        goal_world_m=goal_world_m,
    )
    return recording, floor_z_m


def _name(camera: object) -> str:
    """The name of a camera, which becomes the last word of a group's."""
    if not isinstance(camera, str) or not camera or not camera.isprintable() or "/" in camera or "_" in camera:
        raise ValueError(f"camera must be a name without `/`, `_` and control characters, found {camera!r}")
    return camera


def _point(numbers: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in numbers)
    require_finite("goal_world_m", np.array([x, y, z]))
    return x, y, z


def _iter_frames(
    source: Path, container: Container, dataset: DatasetManifest, records: Sequence[EpisodeRecord]
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    del dataset  # files are given as they are stored
    return iter_recorded(source / container.id, records)


ARRAYS = SourceReader(
    name="arrays", expects=EXPECTS, find_containers=_find_containers, scan=_scan, iter_frames=_iter_frames
)
