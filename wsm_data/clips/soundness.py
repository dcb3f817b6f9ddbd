"""Every check of a run on one container of a source, without anything being written."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from wsm_data.checks.record import check_record
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.episode_gate import check_episode
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_surface import scene_surface
from wsm_data.clips.scene_view import goal_distances, goal_verdicts
from wsm_data.codecs.clip_video import VideoMemory
from wsm_data.errors import DataError
from wsm_data.maps.scene_map import SceneMap, build_scene_map, floor_levels
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container, ContainerScan
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.verdict import Refusal, Verdict


@dataclass(frozen=True, kw_only=True)
class SourceChecks:
    """What is checked, and with which settings.

    Attributes:
        source: root of the source.
        dataset: its conventions.
        clip: what clips would be made of it.
        depth_sample_every: where a scene has no cloud, every n-th depth image is fused into its map.
    """

    source: Path
    dataset: DatasetManifest
    clip: ClipConfig
    depth_sample_every: int


@dataclass(frozen=True, kw_only=True)
class CheckedUnit:
    """What was found of a trajectory, or of a container as a whole.

    Attributes:
        unit: its id.
        container: id of the container it is in.
        frames: of a trajectory; 0 of a container, or where its frames cannot be told.
        digest: of a trajectory's content; empty where there is none.
        verdicts: by the name of the check; `readable` is said of what no check could look at.
    """

    unit: str
    container: str
    frames: int = 0
    digest: str = ""
    verdicts: Mapping[str, Verdict]

    @property
    def findings(self) -> tuple[Refusal, ...]:
        """What is wrong, each with its own reason."""
        return tuple(
            Refusal(
                unit=self.unit,
                source=self.container,
                reason=verdict.reason,
                message=verdict.message,
                details={"check": name, "measured": verdict.measured, "limits": verdict.limits},
            )
            for name, verdict in self.verdicts.items()
            if verdict.reason is not None
        )


def check_container(container: Container, checks: SourceChecks) -> Iterator[CheckedUnit]:
    """Verdicts on all trajectories of a container, and on what keeps it from having any.

    A trajectory that its record alone condemns is not looked at further, as in a run.
    """
    try:
        scan = source_reader(checks.dataset).scan(checks.source, container, checks.dataset, checks.depth_sample_every)
    except DataError as error:
        yield _unreadable(container.id, container.id, error)
        return
    yield from (
        _refused(refusal) for refusal in (*scan.refusals, *([scan.cloud_refusal] if scan.cloud_refusal else []))
    )
    kept = []
    for record in scan.records:
        verdicts = check_record(record, checks.dataset)
        if all(verdict.keep for verdict in verdicts.values()):
            kept.append(record)
        else:
            yield _checked(record, verdicts)
    if not kept or scan.cloud_refusal:
        yield from (_checked(record, check_record(record, checks.dataset)) for record in kept)
        return
    try:
        scene_map = _scene_map(scan, kept, checks.dataset)
        yield from _check_images(container, kept, scene_map, checks)
    except DataError as error:
        yield _unreadable(container.id, container.id, error)


def _scene_map(scan: ContainerScan, records: Sequence[EpisodeRecord], dataset: DatasetManifest) -> SceneMap:
    floors = floor_levels([record.floor_z_m for record in records])
    voxels = scene_surface(scan, records, dataset)
    return build_scene_map(voxels, floors, dataset.robot, dataset.max_camera_height_m)


def _check_images(
    container: Container, records: Sequence[EpisodeRecord], scene_map: SceneMap, checks: SourceChecks
) -> Iterator[CheckedUnit]:
    memory = VideoMemory()
    reader = source_reader(checks.dataset)
    for record, frames in reader.iter_frames(checks.source, container, checks.dataset, records):
        verdicts = check_record(record, checks.dataset)
        try:
            verdicts |= image_verdicts(record, frames, scene_map, checks, memory)
        except DataError as error:
            verdicts["readable"] = Verdict.from_error(error)
        yield _checked(record, verdicts)


def image_verdicts(
    record: EpisodeRecord, frames: EpisodeFrames, scene_map: SceneMap, checks: SourceChecks, memory: VideoMemory
) -> dict[str, Verdict]:
    """Verdicts of all checks that look at images or at the map of a scene.

    Raises:
        DataError: a frame does not decode, or path and map are too far apart to be looked at together.
    """
    dataset = checks.dataset
    laid = lay_path(record, scene_map, dataset, checks.clip)
    verdicts, _ = check_episode(record, frames, scene_map, laid, dataset, checks.clip, memory)
    _, distance_m = goal_distances(record, laid, dataset, checks.clip)
    verdicts |= goal_verdicts(record, distance_m, checks.clip)
    return verdicts


def _checked(record: EpisodeRecord, verdicts: Mapping[str, Verdict]) -> CheckedUnit:
    return CheckedUnit(
        unit=record.id.text,
        container=record.container,
        frames=record.frame_count,
        digest=record.content_digest,
        verdicts=verdicts,
    )


def _unreadable(unit: str, container: str, error: DataError) -> CheckedUnit:
    return CheckedUnit(unit=unit, container=container, verdicts={"readable": Verdict.from_error(error)})


def _refused(refusal: Refusal) -> CheckedUnit:
    verdict = Verdict(reason=refusal.reason, message=refusal.message, measured=refusal.details)
    return CheckedUnit(unit=refusal.unit, container=refusal.source, verdicts={"readable": verdict})
