"""`wsm audit`: what leaks between the splits of a release, is there twice, or contradicts itself."""

import json
from collections.abc import Sequence

import typer
from tqdm import tqdm

from wsm_data.access.release import Release, open_release
from wsm_data.curation.audit.finding import AuditFinding, Severity
from wsm_data.curation.audit.guards import AuditConfig, audit_release, count_findings
from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.split import SplitBy
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.json_values import to_json
from wsm_data.shards.manifest import release_digest
from wsm_data.view.drawing.text_table import aligned

_SHOWN_FINDINGS = 3


def audit(
    location: str, split_by: SplitBy, fail_on: Severity | None, near_m: float, as_json: bool, quiet: bool
) -> None:
    """Print what an audit finds, as a table or as JSON.

    Args:
        location: folder or URL of the release.
        split_by: what was promised to be on one side of the split.
        fail_on: mildest severity that fails; None for none.
        near_m: largest distance of near-duplicate paths, m.
        as_json: print JSON on one line a finding, in place of the table.
        quiet: no progress bar.

    Raises:
        ConfigError: an option is wrong.
        IntegrityError: something was found that is as bad as `fail_on`, or the release is damaged.
    """
    config = AuditConfig(split_by=split_by, near=_near(near_m))
    release = open_release(location)
    with tqdm(total=len(release.index), unit="clip", desc="audit", disable=quiet, dynamic_ncols=True) as bar:
        findings = audit_release(release, config, bar.update)
    typer.echo(_json(release, findings) if as_json else _table(release, findings))
    failing = [one for one in findings if fail_on and one.severity.rank >= fail_on.rank]
    if fail_on and failing:
        raise IntegrityError(f"{location}: {len(failing)} findings of severity {fail_on.value} or worse")


def _near(within_m: float) -> DiversityConfig:
    try:
        return DiversityConfig(within_m=within_m)
    except ValueError as error:
        raise ConfigError(f"--near: {error}") from error


def _json(release: Release, findings: Sequence[AuditFinding]) -> str:
    record = {
        "release": release.manifest.name,
        "release_digest": release_digest(release.manifest),
        "clips": len(release.index),
        "counts": {check.value: count for check, count in count_findings(findings).items()},
        "findings": to_json(findings),
    }
    return json.dumps(record, indent=2)


def _table(release: Release, findings: Sequence[AuditFinding]) -> str:
    """One line a check, and below it the worst findings of each."""
    rows = [("check", "found", "worst")]
    for check, count in count_findings(findings).items():
        worst = next((one.severity.value for one in findings if one.check is check), "")
        rows.append((check.value, str(count), worst))
    lines = [f"{release.manifest.name}, {len(release.index)} clips", aligned(rows, right=[1])]
    for check, count in count_findings(findings).items():
        of_check = [one for one in findings if one.check is check]
        lines += [f"\n{check.value}"] if of_check else []
        for one in of_check[:_SHOWN_FINDINGS]:
            lines += [f"  {one.severity.value}: {one.message}", *(f"    {key}" for key in one.clips)]
        lines += [f"  and {count - _SHOWN_FINDINGS} more; --json lists all"] if count > _SHOWN_FINDINGS else []
    return "\n".join(lines)
