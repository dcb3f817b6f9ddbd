"""`wsm verify`: proof that a release is whole, or the name of what is damaged."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from pipelines.running.stage import Outcome, Stage, StageContext, Unit
from wsm_data.access.release import open_release, read_manifest
from wsm_data.access.verify import verify_release
from wsm_data.curation.attached import attached_names, check_attached
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import digest_json, sha256_bytes
from wsm_data.files.locations import is_url
from wsm_data.files.stores import open_store
from wsm_data.files.typed_toml import INPUT
from wsm_data.shards.findings import Finding
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, MANIFEST_NAME, QUARANTINE_NAME

_SHOWN_FINDINGS = 20


@dataclass(frozen=True, kw_only=True)
class VerifyConfig:
    """Settings of `wsm verify`.

    Attributes:
        release: folder or URL of the release.
    """

    release: str = field(metadata=INPUT)


def require_sound(location: str, quiet: bool = False) -> int:
    """Read every byte of a release, its scores and selections; returns the number of clips.

    Raises:
        IntegrityError: lists what is damaged, by shard and clip.
    """
    clips = _require_sound_shards(location, quiet)
    require_sound_attached(location, attached_names(open_store(location)))
    return clips


def sound_findings(location: str, quiet: bool = False) -> list[Finding]:
    """All that is wrong with a release, its scores and selections, as `require_sound` reads them."""
    findings = _shard_findings(location, quiet)
    if findings:  # what stands beside a damaged release is not held to it
        return findings
    release = open_release(location)
    return [found for name in attached_names(release.store) for found in check_attached(release, name)]


def _require_sound_shards(location: str, quiet: bool) -> int:
    manifest = read_manifest(open_store(location))
    require_no_finding(location, _shard_findings(location, quiet))
    return manifest.clips


def _shard_findings(location: str, quiet: bool) -> list[Finding]:
    try:
        total = sum(shard.bytes for shard in read_manifest(open_store(location)).shards)
    except IntegrityError:  # verify_release makes a finding of it
        total = 0
    with tqdm(total=total, unit="B", unit_scale=True, desc="verify", disable=quiet, dynamic_ncols=True) as bar:
        return verify_release(location, bar.update)


def require_sound_attached(location: str, names: Sequence[str]) -> None:
    """Compare scores and selections with the release that they stand in.

    Raises:
        IntegrityError: lists what is damaged.
    """
    if names:
        release = open_release(location)
        require_no_finding(location, [found for name in names for found in check_attached(release, name)])


def _list_units(config: VerifyConfig) -> Sequence[Unit]:
    """The release, and each file about it: another selection is no reason to read the shards again."""
    store = open_store(config.release)
    manifest = read_manifest(store)
    inputs = {"manifest": sha256_bytes(store.read(MANIFEST_NAME))}
    attached = [
        Unit(id=name, inputs={**inputs, "content": sha256_bytes(store.read(name))}, payload=name)
        for name in attached_names(store)
    ]
    if not is_url(config.release):  # a local file that is touched is read again; a remote one is known by its size
        files = sorted(path for path in Path(config.release).iterdir() if _is_read(path.name))
        inputs["files"] = digest_json([[one.name, one.stat().st_size, one.stat().st_mtime_ns] for one in files])
    return [Unit(id=manifest.name, inputs=inputs), *attached]


def _is_read(name: str) -> bool:
    """Whether a file belongs to a release; scores and selections are about it, and each is a unit of its own."""
    return name.endswith(".tar") or name in (MANIFEST_NAME, INDEX_NAME, INVENTORY_NAME, QUARANTINE_NAME)


def _process(batch: Sequence[Unit], config: VerifyConfig, context: StageContext) -> Iterator[Outcome]:
    del context
    for unit in batch:
        if unit.payload:
            require_sound_attached(config.release, [unit.payload])
            yield Outcome(unit=unit.id, digest=unit.inputs["content"], facts={"findings": 0})
        else:
            clips = _require_sound_shards(config.release, quiet=True)
            yield Outcome(unit=unit.id, digest=unit.inputs["manifest"], facts={"clips": clips, "findings": 0})


def require_no_finding(location: str, findings: Sequence[Finding]) -> None:
    """Refuse a release of which something was found.

    Raises:
        IntegrityError: lists the findings.
    """
    if findings:
        raise IntegrityError(_message(location, findings))


def _message(location: str, findings: Sequence[Finding]) -> str:
    lines = [f"  {_line(finding)}" for finding in findings[:_SHOWN_FINDINGS]]
    more = [f"  and {len(findings) - _SHOWN_FINDINGS} more"] if len(findings) > _SHOWN_FINDINGS else []
    count = f"{len(findings)} finding{'s' if len(findings) > 1 else ''}"
    return "\n".join([f"{location} is damaged, {count}:", *lines, *more])


def _line(finding: Finding) -> str:
    place = " ".join(part for part in (finding.shard, finding.clip) if part)
    return ": ".join(part for part in (finding.kind, place, finding.message) if part)


STAGE = Stage(name="verify", version=1, config_type=VerifyConfig, list_units=_list_units, process=_process)
