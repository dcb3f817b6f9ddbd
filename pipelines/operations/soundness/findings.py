"""What is wrong with a source, told as text, JSON, SARIF and annotations; and what of it was known before."""

import json
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import typer

from pipelines.operations.soundness.sarif import sarif_log
from wsm_data.errors import BudgetExceeded, ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.json_values import to_json
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class Telling:
    """How findings are told.

    Attributes:
        as_json: everything as JSON on standard output, in place of lines of text.
        sarif: file for SARIF 2.1.0; None for none.
        baseline: JSON of an earlier call, whose findings are known and do not fail; None for none.
        github: write annotations for GitHub's runner to standard error as well.
        quiet: no progress bar.
    """

    as_json: bool = False
    sarif: Path | None = None
    baseline: Path | None = None
    github: bool = False
    quiet: bool = False


@dataclass(frozen=True, kw_only=True)
class FindingsReport:
    """What was found.

    Attributes:
        source: what was looked at.
        dataset: the manifest it was read with.
        units: every unit that was looked at, with its numbers.
        findings: what is wrong and was not known.
        known: what is wrong and stands in the baseline.
    """

    source: str
    dataset: str
    units: tuple[object, ...]
    findings: tuple[Refusal, ...]
    known: tuple[Refusal, ...] = ()


Key = tuple[str, str]


def finding_key(finding: Refusal) -> Key:
    """What makes a finding the same in another call: its code and its unit, not its numbers and not its words."""
    return str(finding.reason), finding.unit


def read_baseline(path: Path) -> frozenset[Key]:
    """Findings that are known, from the JSON that an earlier call printed.

    Raises:
        ConfigError: the file is not there, or is something else.
    """
    try:
        said = json.loads(path.read_bytes())
        return frozenset((str(one["reason"]), str(one["unit"])) for one in [*said["findings"], *said["known"]])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"--baseline {path} must be what an earlier call with --json printed, but: {error!r}; make it anew"
        ) from error


def tell(report: FindingsReport, telling: Telling, tool: str) -> None:
    """Print a report, write its files, and fail where it holds something new.

    Args:
        report: findings, none of them taken for known yet.
        telling: where to.
        tool: the command, as `wsm check`.

    Raises:
        BudgetExceeded: there are findings that the baseline does not have.
        ConfigError: the baseline cannot be read.
    """
    expected = read_baseline(telling.baseline) if telling.baseline else frozenset()
    new = tuple(one for one in report.findings if finding_key(one) not in expected)
    known = tuple(one for one in report.findings if finding_key(one) in expected)
    report = replace(report, findings=new, known=known)
    if telling.sarif is not None:
        write_text(telling.sarif, json.dumps(sarif_log(new, known, tool), indent=2) + "\n")
    typer.echo(json.dumps(to_json(report), indent=2) if telling.as_json else "\n".join(_lines(report)))
    if telling.github:
        for finding in new:
            typer.echo(annotation(finding), err=True)
    if new:
        raise BudgetExceeded(f"{report.source}: {len(new)} findings in {len(report.units)} units")


def annotation(finding: Refusal) -> str:
    """A finding as a command of GitHub's runner, which shows it at the file that is named.

    In a message % and line ends are escaped, in a property : and , too
    (docs.github.com/actions/reference/workflow-commands-for-github-actions).
    """
    place, title = (_escaped(text).replace(":", "%3A").replace(",", "%2C") for text in (finding.source, finding.reason))
    return f"::error file={place},title={title}::{_escaped(finding.message)}"


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _lines(report: FindingsReport) -> list[str]:
    counts = Counter(str(one.reason) for one in report.findings)
    return [
        *(f"{one.unit}: {one.reason}: {one.message}" for one in report.findings),
        f"{report.source} (manifest {report.dataset}): {len(report.units)} units looked at, "
        f"{len(report.findings)} findings, {len(report.known)} known",
        *(f"  {reason}: {count}" for reason, count in sorted(counts.items())),
    ]
