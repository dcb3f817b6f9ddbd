"""What a source holds: the manifests that fit its layout, and what the first pass of `wsm index` would make of it."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import typer

from pipelines.operations.soundness.check_source import source_checks
from pipelines.operations.soundness.source_manifest import fitting_manifests, layouts
from wsm_data.checks.record import record_refusal
from wsm_data.clips.soundness import SourceChecks
from wsm_data.errors import DataError
from wsm_data.files.json_values import to_json
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class SourceDescription:
    """What was found of a source.

    Attributes:
        dataset: the manifest it was read with.
        reader: its reader.
        fits: all manifests whose layout fits, the one that was taken first.
        containers: how many there are.
        read: how many of them were read.
        trajectories: usable ones in the containers that were read.
        frames: of these.
        cameras: usable trajectories by `name width x height fx`.
        with_cloud: containers with a point cloud.
        notes: trajectories by note.
        refusals: what would be refused, with the reason.
    """

    dataset: str
    reader: str
    fits: tuple[str, ...]
    containers: int
    read: int
    trajectories: int
    frames: int
    cameras: dict[str, int]
    with_cloud: int
    notes: dict[str, int]
    refusals: tuple[Refusal, ...]


def show_source(source: Path, dataset: str, limit: int, as_json: bool) -> None:
    """Print what a source holds.

    Raises:
        ConfigError: no manifest fits, or the one that was given does not.
    """
    found = describe_source(source, dataset, limit)
    typer.echo(json.dumps(to_json(found), indent=2) if as_json else "\n".join(_lines(found)))


def describe_source(source: Path, dataset: str, limit: int) -> SourceDescription:
    """Read the containers of a source as `wsm index` would, and write nothing.

    Args:
        source: its root.
        dataset: the manifest to read it with; empty: the first that fits of `source_manifest.GUESSES`.
        limit: how many containers are read at most; 0: all.

    Raises:
        ConfigError: as `show_source`.
    """
    fits = [dataset] if dataset else fitting_manifests(source)
    checks = source_checks(source, fits[0])
    manifest = checks.dataset
    containers = source_reader(manifest).find_containers(source, manifest)
    read = containers[:limit] if limit else containers
    kept: list[EpisodeRecord] = []
    refusals: list[Refusal] = []
    with_cloud = 0
    for container in read:
        records, refused, has_cloud = _read(container, checks)
        kept += records
        refusals += refused
        with_cloud += has_cloud
    cameras = [(one.id.camera, one.intrinsics) for one in kept]
    return SourceDescription(
        dataset=manifest.name,
        reader=manifest.reader,
        fits=tuple(fits),
        containers=len(containers),
        read=len(read),
        trajectories=len(kept),
        frames=sum(record.frame_count for record in kept),
        cameras=dict(Counter(f"{name} {K.width} x {K.height} px, fx {K.fx:g}" for name, K in cameras)),
        with_cloud=with_cloud,
        notes=dict(Counter(note for record in kept for note in record.notes)),
        refusals=tuple(refusals),
    )


def _read(container: Container, checks: SourceChecks) -> tuple[list[EpisodeRecord], list[Refusal], bool]:
    """The usable records of a container, what would be refused, and whether there is a cloud, which is let go."""
    try:
        scan = source_reader(checks.dataset).scan(checks.source, container, checks.dataset, checks.depth_sample_every)
    except DataError as error:
        return [], [Refusal.from_error(container.id, container.id, error)], False
    refusals = [*scan.refusals, *([scan.cloud_refusal] if scan.cloud_refusal else [])]
    told = [(record, record_refusal(record, checks.dataset)) for record in scan.records]
    refusals += [refusal for _, refusal in told if refusal]
    return [record for record, refusal in told if refusal is None], refusals, scan.cloud is not None


def _lines(found: SourceDescription) -> list[str]:
    lines = [
        f"manifest: {found.dataset} (reader {found.reader})",
        *([f"fit as well: {', '.join(found.fits[1:])}; choose with --dataset"] if found.fits[1:] else []),
        f"containers: {found.containers}, of which {found.read} were read, {found.with_cloud} with a point cloud",
        f"trajectories: {found.trajectories} of {found.frames} frames",
        *(f"camera: {name}: {count} trajectories" for name, count in found.cameras.items()),
        *(f"note: {name}: {count} trajectories" for name, count in found.notes.items()),
        f"would be refused: {len(found.refusals)}",
        *(f"  {one.unit}: {one.reason}: {one.message}" for one in found.refusals),
    ]
    if not found.trajectories:
        lines += [f"nothing can be used; is it another layout? What was looked for:\n{layouts()}"]
    return lines
