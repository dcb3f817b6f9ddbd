"""How much may be refused before a stage stops."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from pipelines.running.stage import DONE, REFUSED, Outcome
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class RefusalCount:
    """What was refused of what was found.

    Attributes:
        units: refused units.
        listed: units of the listing.
        parts: refused parts of units that are done, and what `finish` refused.
        found: parts of units that are done, refused ones included; in a stage that does not count them, `listed`. None
            while units are being worked on.
        part: what a part is called, in the plural.
    """

    units: int
    listed: int
    parts: int = 0
    found: int | None = None
    part: str = "parts"


def count_refusals(
    outcomes: Iterable[Outcome], listed: int, parts_fact: str, extra: Sequence[Refusal] = ()
) -> RefusalCount:
    """Count the refusals of a stage: of units, and of their parts.

    Args:
        outcomes: outcomes of the listed units.
        listed: units of the listing.
        parts_fact: numeric fact that counts the parts that were kept; empty where a unit has none.
        extra: what `finish` refused; a part that it refuses was kept by the unit, and is among those found.
    """
    units = refused_parts = kept = 0
    for outcome in outcomes:
        units += outcome.state == REFUSED
        if outcome.state == DONE:
            refused_parts += len(outcome.refusals)
            kept += int(outcome.facts.get(parts_fact, 0)) if parts_fact else 0
    return RefusalCount(
        units=units,
        listed=listed,
        parts=refused_parts + len(extra),
        found=kept + refused_parts if parts_fact else listed,
        part=parts_fact or "parts",
    )


def with_outcome(count: RefusalCount, outcome: Outcome) -> RefusalCount:
    """The count after one more unit was worked on."""
    refused = outcome.state == REFUSED
    return replace(count, units=count.units + refused, parts=count.parts + (0 if refused else len(outcome.refusals)))


def over_budget(max_refused: float, count: RefusalCount) -> str:
    """What exceeds the budget, in words; empty where nothing does.

    A share is kept by the units and, each for itself, by the parts: a refused container weighs as much as the
    trajectories nobody could count in it, and would vanish among those of the others. A number holds for their sum.
    """
    units = f"{count.units} of {count.listed} units"
    parts = f"{count.parts} {count.part}" if count.found is None else f"{count.parts} of {count.found} {count.part}"
    if max_refused >= 1:
        both = f"{units} and {parts}" if count.parts else units
        return both if count.units + count.parts > max_refused else ""
    if count.units > max_refused * count.listed:
        return units
    return parts if count.found is not None and count.parts > max_refused * count.found else ""
