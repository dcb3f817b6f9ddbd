"""A row of one of the paper's tables: a system, what it knew, and its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

UNKNOWN = "-"


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A number and, where it was measured here, the ends of its interval."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """A row.

    Attributes:
        system: its name, or the label that was given.
        source: `paper` for figures of the paper, `measured` for those of a summary.
        data: world of episodes, or release and split.
        inputs: what the system is given beside the goal; `-` where that is not known.
        goal: `fixed`, or `oracle` where it is recomputed from the true pose; `-` where there is none.
        controller_pose: whose poses the controller tracks by; `-` where nothing is driven.
        protocol: endings and success; `-` where nothing is driven.
        figures: by the names of the table's columns.
    """

    system: str
    source: str
    data: str
    inputs: str
    goal: str = UNKNOWN
    controller_pose: str = UNKNOWN
    protocol: str = UNKNOWN
    figures: Mapping[str, Figure]
