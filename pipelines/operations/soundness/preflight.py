"""`wsm preflight`: did a source come over whole? Read at the speed of its decompression, before anything is built."""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from pipelines.operations.soundness.check_source import source_checks
from pipelines.operations.soundness.findings import FindingsReport, Telling, tell
from pipelines.operations.soundness.source_manifest import fitting_manifests
from pipelines.running.engines.local import run_local
from pipelines.stages.index import count_differences
from wsm_data.clips.soundness import SourceChecks
from wsm_data.errors import ConfigError, DataError, Reason
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import sha256_bytes
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container, Preflight
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.verdict import Refusal

NOT_MENDED_BY_FETCHING = frozenset(
    (
        Reason.ARCHIVE_UNREAD_FORM,
        Reason.ARCHIVE_UNSAFE_MEMBER,
        Reason.CONTAINER_MISPLACED,
        Reason.CONTAINER_SEVERAL_SCENES,
        Reason.CONTAINER_UNSTORABLE_NAME,
        Reason.FILE_TOO_LARGE,
        Reason.FRAME_TOO_LARGE,
        Reason.DEPTH_NOT_16_BIT,
    )
)
"""What is wrong with these is so where they come from."""


@dataclass(frozen=True, kw_only=True)
class _Task:
    container: Container
    checks: SourceChecks
    walk: bool


def preflight(
    source: Path, dataset: str, share: float, workers: int, telling: Telling, refetch: Path | None = None
) -> None:
    """Read a source and tell what did not come over whole.

    Args:
        source: its root.
        dataset: the manifest to read it with; empty: the likeliest that fits.
        share: share of the containers, chosen by a hash of their ids, that are walked whole.
        workers: processes; 0: one a core.
        telling: how.
        refetch: file for the ids of the containers to fetch again, one a line.

    Raises:
        BudgetExceeded: something is wrong that was not known.
        ConfigError: no manifest fits, or an option is wrong.
    """
    if not 0 <= share <= 1:
        raise ConfigError(f"--sample must lie in [0, 1], found {share}")
    name = dataset or fitting_manifests(source)[0]
    checks = source_checks(source, name)
    manifest = checks.dataset
    containers = source_reader(manifest).find_containers(source, manifest)
    tasks = [_Task(container=one, checks=checks, walk=_chosen(one, share)) for one in containers]
    done = []
    with tqdm(total=len(tasks), unit="container", desc="preflight", disable=telling.quiet, dynamic_ncols=True) as bar:
        for found in run_local(tasks, _look, workers or os.cpu_count() or 1):
            done.append(found)
            bar.update()
    units = tuple(sorted(done, key=lambda one: one.unit))
    broken = tuple(refusal for unit in units for refusal in unit.refusals)
    if refetch is not None:
        again = sorted({one.source for one in broken if one.reason not in NOT_MENDED_BY_FETCHING})
        write_text(refetch, "".join(f"{place}\n" for place in again))
    findings = (*broken, *_missing(units, manifest))
    report = FindingsReport(source=str(source), dataset=name, units=units, findings=findings)
    tell(report, telling, "wsm preflight")


def _chosen(container: Container, share: float) -> bool:
    return int(sha256_bytes(container.id.encode(errors="surrogateescape"))[:8], 16) / 16**8 < share


def _look(task: _Task) -> Iterator[Preflight]:
    source, dataset = task.checks.source, task.checks.dataset
    reader = source_reader(dataset)
    if reader.preflight is not None:
        yield reader.preflight(source, task.container, dataset, task.walk)
    elif not task.walk:
        yield Preflight(unit=task.container.id, walked=False)
    else:
        yield _scanned(task)


def _scanned(task: _Task) -> Preflight:
    """What the first pass of a run says; it looks for the floor in as many depth images as that."""
    unit, checks = task.container.id, task.checks
    try:
        scan = source_reader(checks.dataset).scan(
            checks.source, task.container, checks.dataset, checks.depth_sample_every
        )
    except DataError as error:
        return Preflight(unit=unit, walked=True, refusals=(Refusal.from_error(unit, unit, error),))
    refusals = (*scan.refusals, *([scan.cloud_refusal] if scan.cloud_refusal else []))
    return Preflight(
        unit=unit,
        walked=True,
        bytes_read=scan.bytes_read,
        trajectories=len(scan.records) + len(scan.refusals),
        refusals=refusals,
    )


def _missing(units: Sequence[Preflight], dataset: DatasetManifest) -> list[Refusal]:
    """Groups that hold fewer or more trajectories than were published; told where every container was walked."""
    groups = {unit.unit.split("/")[0] for unit in units}
    partly = {unit.unit.split("/")[0] for unit in units if not unit.walked or unit.refusals}
    found: Counter[str] = Counter()
    for unit in units:
        found[unit.unit.split("/")[0]] += unit.trajectories
    return [
        Refusal(
            unit=group,
            source=group,
            reason=Reason.EPISODE_MISSING,
            message=line,
            details={"found": found[group], "published": dataset.expected_episodes[group]},
        )
        for group in sorted(groups - partly)
        for line in count_differences({group: found[group]}, dataset.expected_episodes)
    ]
