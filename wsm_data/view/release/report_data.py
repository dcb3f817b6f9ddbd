"""What is known about a release beyond its own files, and handed to the report."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

from wsm_data.curation.audit.finding import AuditFinding
from wsm_data.view.release.clip_survey import ClipSurvey


@dataclass(frozen=True, kw_only=True)
class StageSummary:
    """What one stage of the run that made a release did.

    Attributes:
        name: name of the stage.
        version: version of the stage.
        units: units of its inputs.
        done: units that are done.
        refused: units that are refused.
        pending: units without an outcome yet.
        seconds: time spent on its units, summed over workers, s.
        wall_seconds: time in which at least one worker was at a unit, s; pauses between runs are left out.
        workers: worker processes of its last run.
        fingerprint: digest of name, version and settings.
    """

    name: str
    version: int
    units: int
    done: int
    refused: int
    pending: int = 0
    seconds: float
    wall_seconds: float
    workers: int
    fingerprint: str = ""

    @property
    def done_per_s(self) -> float | None:
        """Units done for each second on the wall, the time of refused ones included; None where none was measured."""
        return self.done / self.wall_seconds if self.wall_seconds else None


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A number that was planned before the run, beside what came of it.

    Attributes:
        name: what it is of, with its unit.
        value: what was expected.
        low: lower bound of what was expected.
        high: upper bound.
        actual: what came of it; None where that is not known.
    """

    name: str
    value: float
    low: float
    high: float
    actual: float | None

    @property
    def off(self) -> float | None:
        """What came beyond what was expected, as a share of that; None where one of the two is not known or 0."""
        return None if self.actual is None or not self.value else self.actual / self.value - 1


def covered_seconds(spans: Iterable[tuple[float, float]]) -> float:
    """Length of the union of spans of time (begin, end), s."""
    total, reached = 0.0, -inf
    for begin, end in sorted(spans):
        total += max(0.0, end - max(begin, reached))
        reached = max(reached, end)
    return total


@dataclass(frozen=True, kw_only=True)
class ReportData:
    """Everything the report shows that is not in the release's manifest, index, inventory and quarantine.

    Attributes:
        survey: numbers and pictures of clips.
        stages: the stages in the order of the flow; empty when the folder of the run is not at hand.
        audit: what leaks, is there twice or contradicts itself, worst first; None where nobody looked.
        planned: what `wsm plan` said beforehand; empty where no plan was made.
    """

    survey: ClipSurvey
    stages: tuple[StageSummary, ...] = ()
    audit: tuple[AuditFinding, ...] | None = None
    planned: tuple[Planned, ...] = ()
