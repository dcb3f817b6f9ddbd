"""`wsm audit-latents`: are the latents of a release those of its source? Some clips are encoded again and compared."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from tqdm import tqdm

from pipelines.operations.soundness.check_source import source_checks
from pipelines.operations.soundness.findings import FindingsReport, Telling, tell
from pipelines.operations.soundness.source_manifest import fitting_manifests
from wsm_data.access.release import Release, open_release
from wsm_data.clips.latent_audit import AuditedClip, audit_latents
from wsm_data.clips.soundness import CheckedUnit, SourceChecks
from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import ConfigError, DataError, Reason
from wsm_data.files.digest import sha256_bytes
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container
from wsm_data.schema.verdict import Verdict
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.release_codec import codec_of


def audit_release_latents(
    location: str, source: Path, dataset: str, share: float, weights: str, telling: Telling
) -> None:
    """Encode some clips of a release again from their source, and tell which differ and why.

    Args:
        location: folder or URL of the release.
        source: root of the source it was made of.
        dataset: the manifest to read it with; empty: the likeliest that fits.
        share: share of the clips, chosen by a hash of their keys; at least one is taken.
        weights: folder of the codec's weights, empty where it has none.
        telling: how.

    Raises:
        BudgetExceeded: a clip differs that was not known to.
        ConfigError: the codec is not that of the release, no manifest fits, or an option is wrong.
    """
    if not 0 < share <= 1:
        raise ConfigError(f"--share must lie in (0, 1], found {share}")
    release = open_release(location)
    codec = codec_of(release.manifest, weights)
    name = dataset or fitting_manifests(source)[0]
    checks = source_checks(source, name)
    wanted = {row.unit: row for row in sampled_rows(release, share)}
    units = []
    with tqdm(total=len(wanted), unit="clip", desc="audit-latents", disable=telling.quiet, dynamic_ncols=True) as bar:
        for unit in _audited(release, checks, codec, wanted):
            units.append(unit)
            bar.update()
    units += [_absent(text, source) for text in sorted({*wanted} - {unit.unit for unit in units})]
    findings = tuple(finding for unit in units for finding in unit.findings)
    report = FindingsReport(source=location, dataset=name, units=tuple(units), findings=findings)
    tell(report, telling, "wsm audit-latents")


def sampled_rows(release: Release, share: float) -> list[IndexRow]:
    """The rows with the lowest hashes of their keys: the same in every call, a smaller share in a larger."""
    keys = sorted(release.index.texts("key"), key=lambda key: sha256_bytes(key.encode()))
    return [release.index.row(key) for key in keys[: max(1, round(share * len(keys)))]]


def _audited(
    release: Release, checks: SourceChecks, codec: VideoCodec, wanted: dict[str, IndexRow]
) -> Iterator[CheckedUnit]:
    """Verdicts on the wanted clips that the source has, container by container, until all are found.

    A container is scanned as a run does: the floor, and with it a digest, may follow from the depth that is sampled.
    """
    source, dataset = checks.source, checks.dataset
    reader = source_reader(dataset)
    left = dict(wanted)
    for container in _likeliest_first(reader.find_containers(source, dataset), list(wanted.values())):
        if not left:
            return
        try:
            scan = reader.scan(source, container, dataset, checks.depth_sample_every)
        except DataError:
            continue  # whatever it held is told to be absent
        records = [record for record in scan.records if record.id.text in left]
        for record, frames in reader.iter_frames(source, container, dataset, records) if records else ():
            clip = release.read_row(left.pop(record.id.text))
            audited = AuditedClip(clip=clip, record=record, frames=frames, dataset=dataset, codec=codec)
            try:
                verdict = audit_latents(audited)
            except DataError as error:
                verdict = Verdict.from_error(error)
            yield CheckedUnit(
                unit=record.id.text,
                container=container.id,
                frames=record.frame_count,
                digest=record.content_digest,
                verdicts={"latents": verdict},
            )


def _likeliest_first(containers: Sequence[Container], rows: Sequence[IndexRow]) -> list[Container]:
    """Containers that a wanted scene is named in, then the others, so that few of many are read."""
    scenes = {row.scene for row in rows}
    return sorted(containers, key=lambda container: (not any(scene in container.id for scene in scenes), container.id))


def _absent(text: str, source: Path) -> CheckedUnit:
    message = f"{text} must be in the source {source}, and no container that can be read holds it; is it complete?"
    verdict = Verdict(reason=Reason.LATENT_SOURCE_CHANGED, message=message)
    return CheckedUnit(unit=text, container="", verdicts={"latents": verdict})
