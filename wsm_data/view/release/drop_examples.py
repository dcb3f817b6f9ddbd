"""Why units of a source are not in a release: every reason, how often, and one example."""

from collections import Counter
from dataclasses import dataclass

from wsm_data.access.release import Release


@dataclass(frozen=True, kw_only=True)
class DropExample:
    """One reason for which something was refused, and one refusal under it.

    Attributes:
        reason: the reason code.
        units: trajectories and containers that are not in the release for it.
        refusals: lines of the quarantine under it; a unit may have several.
        stage: stage that refused the example; empty when the quarantine does not say.
        unit: id of the example; empty when the quarantine has no line under this reason.
        message: what the example's refusal says.
    """

    reason: str
    units: int
    refusals: int
    stage: str
    unit: str
    message: str


def drop_examples(release: Release) -> tuple[DropExample, ...]:
    """All reasons of a release, the most frequent first; the example is the first by unit."""
    refusals = Counter(str(line["reason"]) for line in release.quarantine)
    first: dict[str, dict[str, object]] = {}
    for line in release.quarantine:
        first.setdefault(str(line["reason"]), line)
    units = release.manifest.drops
    reasons = sorted({*units, *refusals}, key=lambda reason: (-units.get(reason, 0), -refusals[reason], reason))
    return tuple(
        DropExample(
            reason=reason,
            units=units.get(reason, 0),
            refusals=refusals[reason],
            stage=str(first.get(reason, {}).get("stage", "")),
            unit=str(first.get(reason, {}).get("unit", "")),
            message=str(first.get(reason, {}).get("message", "")),
        )
        for reason in reasons
    )
