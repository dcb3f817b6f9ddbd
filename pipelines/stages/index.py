"""`wsm index`: one sequential pass over every archive and folder of a source."""

import logging
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from pipelines.artifacts.episode_table import (
    EPISODES_FILE,
    EpisodeRow,
    record_digest,
    row_from_json,
    row_json,
    write_episodes,
)
from pipelines.artifacts.layout import conventions_path, records_path, surface_path
from pipelines.artifacts.source import conventions_digest, write_conventions
from pipelines.running.settings import config_json
from pipelines.running.stage import DONE, Finished, Outcome, Settled, Stage, StageContext, Unit, refused
from wsm_data.checks.record import record_refusal
from wsm_data.clips.scene_surface import scene_surface
from wsm_data.curation.split import shortest_first
from wsm_data.errors import DataError, Reason
from wsm_data.files.digest import digest_json, sha256_file
from wsm_data.files.json_values import to_json
from wsm_data.files.typed_toml import INPUT
from wsm_data.maps.voxels import save_voxels, voxels_digest
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.record_table import write_records
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container, ContainerScan
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Refusal

_LOG = logging.getLogger(__name__)


class SameContent(StrEnum):
    """What becomes of trajectories with equal content under several names."""

    REFUSE = "refuse"
    TOGETHER = "together"


@dataclass(frozen=True, kw_only=True)
class IndexConfig:
    """Settings of `wsm index`.

    Attributes:
        source: root of the source tree: groups, with scene archives, scene folders or trajectory folders in them.
        dataset: manifest with the source's conventions: a name under manifests/datasets/, or a TOML file. What it says
            is part of every unit's inputs, what it is called is not.
        depth_sample_every: where a scene has no cloud, every n-th depth frame is fused into its map, but for those of
            trajectories whose depth contradicts their poses; `encode` refuses these.
        same_content: of trajectories with equal content under several names, `refuse` all but one; or keep all and
            leave it to `split` to put them on one side, `together`.
    """

    source: Path = field(metadata=INPUT)
    dataset: str = field(default="interndata_n1", metadata=INPUT)
    depth_sample_every: int = 10
    same_content: SameContent = SameContent.REFUSE

    def __post_init__(self) -> None:
        if self.depth_sample_every < 1:
            raise ValueError(f"depth_sample_every must be at least 1, found {self.depth_sample_every}")


def _list_units(config: IndexConfig) -> Sequence[Unit]:
    dataset = load_dataset(config.dataset)
    conventions = conventions_digest(dataset)
    return [
        Unit(
            id=container.id,
            source=container.id,
            inputs={"files": container.signature, "dataset": conventions},
            payload=container,
        )
        for container in source_reader(dataset).find_containers(config.source, dataset)
    ]


def _process(batch: Sequence[Unit], config: IndexConfig, context: StageContext) -> Iterator[Outcome]:
    dataset = load_dataset(config.dataset)
    for unit in batch:
        try:
            yield _index_container(unit, unit.payload, config, dataset, context.out)
        except DataError as error:
            yield refused(unit, error)


def _index_container(
    unit: Unit, container: Container, config: IndexConfig, dataset: DatasetManifest, out: Path
) -> Outcome:
    scan = source_reader(dataset).scan(config.source, container, dataset, config.depth_sample_every)
    kept, refusals = _checked(scan, dataset)
    records = records_path(out, container.id)
    records.parent.mkdir(parents=True, exist_ok=True)
    write_records(records, kept)
    surface, cloud_refusal = _write_surface(container, scan, kept, dataset, surface_path(out, container.id))
    rows = [row_json(_row(record)) for record in kept]
    facts = {
        "frames": sum(record.frame_count for record in kept),
        "trajectories": len(kept),
        "container": to_json(container),
        "episodes": rows,
        "surface": surface,
        "cloud_refusal": cloud_refusal and to_json(cloud_refusal),
        "bytes": scan.bytes_read,
    }
    outputs = [records, *([surface_path(out, container.id)] if surface else [])]
    return Outcome(
        unit=unit.id,
        digest=digest_json([sha256_file(records), surface, facts["cloud_refusal"], unit.inputs["dataset"]]),
        outputs=tuple(str(path.relative_to(out)) for path in outputs),
        facts=facts,
        refusals=tuple(refusals),
    )


def _checked(scan: ContainerScan, dataset: DatasetManifest) -> tuple[list[EpisodeRecord], list[Refusal]]:
    """Records that pass every check, and the refusals of the others, the reader's own included."""
    kept, refusals = [], list(scan.refusals)
    for record in scan.records:
        refusal = record_refusal(record, dataset)
        if refusal is None:
            kept.append(record)
        else:
            refusals.append(refusal)
    return kept, refusals


def _write_surface(
    container: Container, scan: ContainerScan, records: Sequence[EpisodeRecord], dataset: DatasetManifest, path: Path
) -> tuple[str, Refusal | None]:
    """Write the scene's surface; returns its digest, or the empty text and the reason why there is none."""
    if scan.cloud_refusal is not None:
        return "", scan.cloud_refusal
    try:
        voxels = scene_surface(scan, records, dataset)
    except DataError as error:
        return "", Refusal.from_error(container.id, container.id, error)
    save_voxels(path, voxels)
    return voxels_digest(voxels), None


def _row(record: EpisodeRecord) -> EpisodeRow:
    return EpisodeRow(
        id=record.id,
        container=record.container,
        digest=record.content_digest,
        record_digest=record_digest(record),
        frames=record.frame_count,
        floor_z_m=record.floor_z_m,
    )


def _finish(config: IndexConfig, context: StageContext, settled: Settled) -> Finished:
    """Write the table of trajectories; of those found twice the first container's stays, the others are refused."""
    dataset = load_dataset(config.dataset)
    write_conventions(context.out, dataset)
    first: dict[str, Mapping[str, object]] = {}
    refusals = []
    for container, outcome in sorted(settled.outcomes.items()):
        for row in outcome.facts.get("episodes", ()) if outcome.state == DONE else ():
            kept = first.setdefault(row["id"], row)
            if kept is not row:
                refusals.append(_duplicate(container, row, kept))
    if config.same_content is SameContent.REFUSE:
        refusals += _take_out_same_content(first)
    rows = [row_from_json(row) for row in first.values()]
    write_episodes(context.out, rows)
    if not settled.pending:
        refused_episodes = [one.unit for outcome in settled.outcomes.values() for one in outcome.refusals]
        found = Counter(unit.split("/")[0] for unit in (*(row.id.text for row in rows), *refused_episodes))
        for line in count_differences(found, dataset.expected_episodes):
            _LOG.warning("%s", line)
    outputs = (EPISODES_FILE, str(conventions_path(context.out).relative_to(context.out)))
    return Finished(refusals=tuple(refusals), outputs=outputs)


def _conventions(config: IndexConfig) -> DatasetManifest:
    return load_dataset(config.dataset)


def _finish_inputs(config: IndexConfig) -> Mapping[str, str]:
    """What the manifest says beside the conventions, its licence above all, is written down without reading again."""
    return {"manifest": digest_json(config_json(load_dataset(config.dataset)))}


def count_differences(found: Mapping[str, int], expected: Mapping[str, int]) -> list[str]:
    """A line for every group of the source that does not hold as many trajectories as were published.

    Groups that are not there at all are not missed: people download what they need.

    Args:
        found: trajectories and refusals by group.
        expected: published trajectories by group.
    """
    return [
        f"{group}: {expected[group]:,} trajectories were published, {count:,} are here, refused ones included; "
        "is the download complete?"
        for group, count in sorted(found.items())
        if group in expected and count != expected[group]
    ]


def _take_out_same_content(rows: dict[str, Mapping[str, object]]) -> list[Refusal]:
    """Of trajectories with equal content under several ids, leave the one with the shortest id, the first of these."""
    kept: dict[object, Mapping[str, object]] = {}
    refusals = []
    for name in sorted(rows, key=shortest_first):
        row = kept.setdefault(rows[name]["digest"], rows[name])
        if row is not rows[name]:
            refusals.append(_same_content(rows.pop(name), row))
    return refusals


def _same_content(row: Mapping[str, object], kept: Mapping[str, object]) -> Refusal:
    return Refusal(
        unit=str(row["id"]),
        source=str(row["container"]),
        reason=Reason.EPISODE_SAME_CONTENT,
        message=f"{row['id']} has the same content (images, poses, cameras) as {kept['id']} in {kept['container']}, and"
        " is left out: the two could stand in training and test; remove one of them from the source, or keep"
        ' both on one side of the split with index.same_content="together"',
        details={"kept_in": kept["container"], "kept_as": kept["id"]},
    )


def _duplicate(container: str, row: Mapping[str, object], kept: Mapping[str, object]) -> Refusal:
    same = row["digest"] == kept["digest"]
    content = "the same content" if same else "other content"
    return Refusal(
        unit=str(row["id"]),
        source=container,
        reason=Reason.EPISODE_DUPLICATE,
        message=f"{row['id']} stands in {kept['container']} too, with {content}; the one in {container} is left out: "
        "remove one of them, or rename the trajectory",
        details={"kept_in": kept["container"], "same_content": same},
    )


STAGE = Stage(
    name="index",
    version=4,
    config_type=IndexConfig,
    list_units=_list_units,
    process=_process,
    finish=_finish,
    parts_fact="trajectories",
    finish_inputs=_finish_inputs,
    conventions=_conventions,
)
