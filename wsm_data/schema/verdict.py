"""What a check says of a record, and what is written down when something is refused."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from wsm_data.errors import DataError, Reason


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The outcome of a quality gate: a value, never an exception.

    Attributes:
        reason: None to keep the record, else why it is refused.
        message: what must hold, what was found, where, what to do.
        measured: the numbers behind the decision, with units in their names; reported for kept records too.
    """

    reason: Reason | None = None
    message: str = ""
    measured: Mapping[str, object] = field(default_factory=dict)

    @property
    def keep(self) -> bool:
        """Whether the record goes on."""
        return self.reason is None


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """One unit that does not go on: a line of quarantine.jsonl before the runner adds stage and time.

    Attributes:
        unit: id of the container or episode.
        source: file or folder it came from, relative to the source root.
        reason: the code it is counted under.
        message: for a person.
        details: measured numbers and names; JSON values.
    """

    unit: str
    source: str
    reason: Reason
    message: str
    details: Mapping[str, object] = field(default_factory=dict)

    @classmethod
    def from_error(cls, unit: str, source: str, error: DataError) -> "Refusal":
        """Write down a `DataError` that was raised while working on `unit`."""
        return cls(unit=unit, source=source, reason=error.reason, message=error.message, details=error.details)
