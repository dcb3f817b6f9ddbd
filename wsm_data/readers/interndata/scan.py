"""The first pass over a container: what is in it, what of it can be used, and why the rest cannot."""

from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.readers.interndata.containers import EXPECTS, place_of
from wsm_data.readers.interndata.contents import Contents, FolderContents, FrameKey, read_contents
from wsm_data.readers.interndata.naming import episode_name
from wsm_data.readers.interndata.path_points import without_path
from wsm_data.readers.interndata.record import build_record, episode_numbers
from wsm_data.readers.source import Container, ContainerScan, DepthSample
from wsm_data.schema.dataset import CloudColours, DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.source.layout import Layout
from wsm_data.schema.verdict import Refusal


def scan_container(
    source: Path, container: Container, dataset: DatasetManifest, depth_sample_every: int
) -> ContainerScan:
    """Read a container once and sort what is in it.

    Args:
        source: root of the source tree.
        container: one of `find_containers(source, dataset)`.
        dataset: the conventions of the source.
        depth_sample_every: which depth images are kept where there is no cloud: those of every n-th frame.

    Raises:
        DataError: the container as a whole cannot be used: an `archive.*` reason, `container.several_scenes`,
            `container.no_episodes`, or `episode.duplicate` when a trajectory folder holds more than one episode.
    """
    contents = read_contents(source, container, depth_sample_every, dataset.limits)
    records: dict[str, EpisodeRecord] = {}
    refusals: dict[str, Refusal] = {}
    samples: dict[str, tuple[DepthSample, ...]] = {}
    for id_, folder, number in _episodes(container, contents):
        try:
            if id_.text in records or id_.text in refusals:
                raise _duplicate(container, id_)
            record, depth_keys = build_record(id_, container.id, folder, number, dataset)
        except DataError as error:
            records.pop(id_.text, None)
            refusals[id_.text] = Refusal.from_error(id_.text, container.id, error)
        else:
            records[id_.text] = record
            samples[id_.text] = _samples(folder, depth_keys, depth_sample_every)
    cloud, cloud_refusal = _cloud(container, contents, dataset.cloud)
    return ContainerScan(
        records=tuple(records[text] for text in sorted(records)),
        refusals=tuple(refusals[text] for text in sorted(refusals)),
        cloud=cloud,
        cloud_refusal=cloud_refusal,
        depth_samples={} if contents.has_cloud else {text: samples[text] for text in sorted(records)},
        bytes_read=contents.bytes_read,
    )


def _episodes(container: Container, contents: Contents) -> list[tuple[EpisodeId, FolderContents, int]]:
    """All episodes of a container, usable or not, in the order of their folders and numbers."""
    place = place_of(container)
    found = []
    for name, folder in sorted(contents.folders.items()):
        trajectory = place.episode if container.layout == Layout.TRAJECTORY_FOLDER else name
        numbers = episode_numbers(folder, in_trajectory=bool(trajectory), alone=len(contents.folders) == 1)
        if name and len(numbers) > 1:
            raise DataError(
                Reason.CONTAINER_MISPLACED,
                f"{container.id}: a scene must lie in one folder of its archive, as <scene>/data; {name} holds the "
                f"episodes {numbers[:5]}, so it is a scene one level deeper; pack it anew from within its group",
                {"folder": name, "episodes": numbers},
            )
        if trajectory and len(numbers) > 1:
            raise DataError(
                Reason.EPISODE_DUPLICATE,
                f"{container.id}: trajectory folder {trajectory} must hold one episode, found the numbers {numbers}",
                {"folder": trajectory, "episodes": numbers},
            )
        for number in numbers:
            episode = episode_name(trajectory) if trajectory else f"{number:06d}"
            found.append((EpisodeId(place.group, place.scene, episode), folder, number))
    if not found:
        raise DataError(
            Reason.CONTAINER_NO_EPISODES,
            f"{container.id} must hold a scene or a trajectory (data/chunk-*/episode_*.parquet and images below "
            f"videos/), found no episode, but {contents.unread.summary()}; remove or complete it, or correct the "
            f"source: it is the folder that holds the groups, with {EXPECTS} below it",
        )
    return found


def _duplicate(container: Container, id_: EpisodeId) -> DataError:
    message = (
        f"{container.id}: the episode {id_.text} is there twice, and which one is meant cannot be told; remove one"
    )
    return DataError(Reason.EPISODE_DUPLICATE, message, {"episode": id_.text})


def _samples(folder: FolderContents, depth_keys: list[FrameKey], every: int) -> tuple[DepthSample, ...]:
    return tuple(
        (index, folder.depth_png[depth_keys[index]])
        for index in range(0, len(depth_keys), every)
        if depth_keys[index] in folder.depth_png
    )


def _cloud(container: Container, contents: Contents, colours: CloudColours) -> tuple[PointCloud | None, Refusal | None]:
    """The cloud of the scene: its own, or of all its trajectory folders together, there without their paths."""
    clouds: list[PointCloud] = []
    for trajectory, folder in sorted(contents.folders.items()):
        name = min(folder.clouds, key=lambda name: ("path.ply" in name, name), default=None)
        cloud = folder.clouds[name] if name is not None else None
        if isinstance(cloud, DataError):
            return None, Refusal.from_error(container.id, container.id, cloud)
        if name is not None and cloud is not None:
            shows_path = _shows_path(name, bool(trajectory) or container.layout == Layout.TRAJECTORY_FOLDER)
            clouds.append(without_path(cloud, colours) if shows_path else cloud)
    if len(clouds) > 1:
        xyz_m = np.concatenate([cloud.xyz_m for cloud in clouds])
        return PointCloud(xyz_m=xyz_m, rgb_u8=np.concatenate([cloud.rgb_u8 for cloud in clouds])), None
    return (clouds[0] if clouds else None), None


def _shows_path(name: str, in_trajectory: bool) -> bool:
    """Whether black means the path in this cloud: only in a trajectory's own, not in the one its scene lends to it."""
    return name.endswith("/path.ply") or (in_trajectory and not name.startswith("../"))
