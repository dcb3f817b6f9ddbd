"""What a check says of a record, and what is written down when something is refused."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wsm_data.errors import DataError, Reason


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The outcome of a quality gate: a value, never an exception. Numbers are kept as JSON values, as in `Refusal`.

    Attributes:
        reason: None to keep the record, else why it is refused.
        message: what must hold, what was found, where, what to do.
        measured: the numbers behind the decision, with units in their names; reported for kept records too.
        limits: what was allowed, by name: of a number in `measured`, or of the setting that it stands for.
    """

    reason: Reason | None = None
    message: str = ""
    measured: Mapping[str, object] = field(default_factory=dict)
    limits: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("measured", "limits"):
            object.__setattr__(self, name, _json_value(getattr(self, name)))

    @classmethod
    def from_error(cls, error: DataError) -> "Verdict":
        """What a `DataError` says of the record that was worked on."""
        return cls(reason=error.reason, message=error.message, measured=error.details)

    @property
    def keep(self) -> bool:
        """Whether the record goes on."""
        return self.reason is None


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """One unit that does not go on: a line of quarantine.jsonl before the runner adds stage and time.

    What broke a unit is often NaN, infinite, an array or a path. So that writing it down never fails, details are
    turned into JSON values here: numpy values into numbers and lists, what JSON does not have into its text.

    Attributes:
        unit: id of the container or episode.
        source: file or folder it came from, relative to the source root.
        reason: the code it is counted under.
        message: for a person.
        details: measured numbers and names.
    """

    unit: str
    source: str
    reason: Reason
    message: str
    details: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "details", _json_value(self.details))

    @classmethod
    def from_error(cls, unit: str, source: str, error: DataError) -> "Refusal":
        """Write down a `DataError` that was raised while working on `unit`."""
        return cls(unit=unit, source=source, reason=error.reason, message=error.message, details=error.details)


def _json_value(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _json_value(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [_json_value(item) for item in value]
    exact = value is None or isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))
    return value if exact else str(value)
