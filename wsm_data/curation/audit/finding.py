"""What an audit finds: one thing about some clips, and how bad it is."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How bad a finding is, mildest first."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"

    @property
    def rank(self) -> int:
        """0 for the mildest."""
        return list(Severity).index(self)


class Check(StrEnum):
    """What was looked for."""

    SCENE_IN_SPLITS = "split.same_scene"
    PATH_IN_SPLITS = "split.near_duplicate"
    CONTENT_TWICE = "content.duplicate"
    DISTANCE_CONFLICT = "label.expert_distance"
    MAP_CONFLICT = "label.map"


@dataclass(frozen=True, kw_only=True)
class AuditFinding:
    """One finding.

    Attributes:
        check: what was looked for.
        severity: how bad it is.
        clips: keys of the clips it is about, or some of them, sorted.
        message: what was found, with numbers and units.
    """

    check: Check
    severity: Severity
    clips: tuple[str, ...]
    message: str


def worst_first(findings: Iterable[AuditFinding]) -> list[AuditFinding]:
    """Findings by severity, then check, then clips."""
    return sorted(findings, key=lambda one: (-one.severity.rank, list(Check).index(one.check), one.clips))
