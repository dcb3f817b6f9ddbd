"""What a run of a stage did, as a value and as the table that is printed at its end."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.running.stage import DONE, REFUSED, Settled
from wsm_data.schema.verdict import Refusal
from wsm_data.view.drawing.text_table import aligned

_MILLION, _THOUSAND = 1e6, 1e4


@dataclass(frozen=True, kw_only=True)
class StageReport:
    """What a run of a stage did, and where the stage stands.

    Attributes:
        stage: name of the stage.
        out: its folder (another than asked for after a fork).
        listed: units of the inputs.
        ran: ids of the units this run worked on, or would work on in a dry run.
        done: units of the listing that are done.
        refused: units of the listing that are refused.
        pending: units of the listing that have no outcome yet.
        refused_parts: refused parts of units that are done, and what `finish` refused.
        refusals: number of refusals by reason; refused parts count too.
        facts: numeric facts of done units, summed.
        seconds: wall time of this run.
        waits_for: inputs that have pending units, so that what is listed here is not the last word.
    """

    stage: str
    out: Path
    listed: int
    ran: tuple[str, ...]
    done: int
    refused: int
    pending: int
    refused_parts: int = 0
    refusals: Mapping[str, int] = field(default_factory=dict)
    facts: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    waits_for: tuple[str, ...] = ()


def stage_report(
    stage: str, out: Path, settled: Settled, ran: Sequence[str], seconds: float, extra: Sequence[Refusal] = ()
) -> StageReport:
    """Count the outcomes of a stage, and the refusals that belong to none of them."""
    outcomes = settled.outcomes.values()
    facts: dict[str, float] = {}
    for outcome in outcomes:
        for name, value in outcome.facts.items():
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                facts[name] = facts.get(name, 0) + value
    refusals = Counter(one.reason.value for one in (*(two for one in outcomes for two in one.refusals), *extra))
    return StageReport(
        stage=stage,
        out=out,
        listed=len(settled.outcomes) + len(settled.pending),
        ran=tuple(ran),
        done=sum(outcome.state == DONE for outcome in outcomes),
        refused=sum(outcome.state == REFUSED for outcome in outcomes),
        pending=len(settled.pending),
        refused_parts=sum(len(outcome.refusals) for outcome in outcomes if outcome.state == DONE) + len(extra),
        refusals=dict(sorted(refusals.items())),
        facts=dict(sorted(facts.items())),
        seconds=seconds,
    )


def beyond_outcomes(settled: Settled, refusals: Sequence[Refusal]) -> list[Refusal]:
    """Those refusals that belong to no outcome: what the end of the stage refused."""
    known = {(one.unit, one.source, one.reason) for outcome in settled.outcomes.values() for one in outcome.refusals}
    return [one for one in refusals if (one.unit, one.source, one.reason) not in known]


def summary_table(reports: Sequence[StageReport]) -> str:
    """The reports as an aligned table, refusals by reason below."""
    header = ("stage", "units", "ran", "done", "refused", "pending", "seconds", "facts")
    rows = [header] + [
        (
            report.stage,
            str(report.listed),
            str(len(report.ran)),
            str(report.done),
            f"{report.refused} + {report.refused_parts} parts" if report.refused_parts else str(report.refused),
            str(report.pending),
            f"{report.seconds:.1f}",
            ", ".join(f"{name} {_number(value)}" for name, value in report.facts.items()),
        )
        for report in reports
    ]
    reasons = [
        f"  {report.stage}: {count} x {reason}" for report in reports for reason, count in report.refusals.items()
    ]
    waiting = [
        f"{report.stage} will be listed anew once nothing is pending in: {', '.join(report.waits_for)}"
        for report in reports
        if report.waits_for
    ]
    return "\n".join(
        [aligned(rows, right=range(1, 7)), *(["refused, by reason:", *reasons] if reasons else []), *waiting]
    )


def _number(value: float) -> str:
    if value >= _MILLION:
        return f"{value / _MILLION:.1f} M"
    return f"{value:,.0f}" if value == int(value) or value >= _THOUSAND else f"{value:.2f}"
