"""inventory.parquet and quarantine.jsonl: whatever went in, once, as a clip or as a refusal."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path

import pyarrow as pa

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import write_bytes
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.files.tables import opened_table, read_full, write_table
from wsm_data.schema.identity import EpisodeId

_TIME_FIELDS = ("time", "seconds")
_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("unit", "container", "state", "split", "reason", "source_digest")]
)


class UnitState(StrEnum):
    """What became of a unit."""

    CLIP = "clip"
    REFUSED = "refused"
    PENDING = "pending"


@dataclass(frozen=True, kw_only=True)
class InventoryRow:
    """One trajectory, or one container that was refused as a whole.

    Attributes:
        unit: id of the trajectory or container; every unit stands in the inventory once.
        container: archive or folder it came from, relative to the source root.
        state: what became of it; `pending` in a partial release only.
        split: split of a clip, empty otherwise.
        reason: reason code of a refusal, empty otherwise.
        source_digest: content digest of a trajectory, empty where it could not be read.
    """

    unit: str
    container: str
    state: UnitState
    split: str = ""
    reason: str = ""
    source_digest: str = ""

    def __post_init__(self) -> None:
        if (self.state == UnitState.CLIP) != bool(self.split):
            raise ValueError(
                f"{self.unit}: a clip has a split and nothing else has, found {self.split!r}, {self.state}"
            )
        if (self.state == UnitState.REFUSED) != bool(self.reason):
            raise ValueError(
                f"{self.unit}: a refusal has a reason and nothing else, found {self.reason!r}, {self.state}"
            )
        if self.state == UnitState.CLIP:
            EpisodeId.parse(self.unit)


def write_inventory(path: Path, rows: Iterable[InventoryRow]) -> None:
    """Write the inventory atomically, sorted by unit."""
    records = [
        to_json(row) | {"unit": printable(row.unit), "container": printable(row.container)}
        for row in sorted(rows, key=lambda row: (row.unit, row.container, row.state, row.reason))
    ]
    write_table(path, pa.Table.from_pylist(records, schema=_SCHEMA), compression="zstd")


def parse_inventory(data: bytes, where: str) -> tuple[InventoryRow, ...]:
    """Read an inventory from the bytes of its file.

    Raises:
        IntegrityError: it is not an inventory.
    """
    must_be = f"{where} must be the inventory of a release"
    with opened_table(partial(pa.BufferReader, data), must_be, "restore the file") as file:
        return tuple(from_json(InventoryRow, row) for row in read_full(file, _SCHEMA).to_pylist())


def write_quarantine(path: Path, refusals: Iterable[Mapping[str, object]]) -> None:
    """Write the refusals of all stages atomically, sorted, without the times at which they happened.

    Raises:
        ValueError: a refusal names no unit or no reason.
    """
    lines = []
    for refusal in refusals:
        if not refusal.get("unit") or not refusal.get("reason"):
            raise ValueError(f"a refusal must name its unit and reason, found {dict(refusal)}")
        kept = {key: value for key, value in refusal.items() if key not in _TIME_FIELDS}
        kept["unit"] = printable(str(refusal["unit"]))
        lines.append((kept["unit"], canonical_json(kept)))
    write_bytes(path, b"".join(line.encode() + b"\n" for _, line in sorted(lines)))


def parse_quarantine(data: bytes, where: str) -> tuple[dict[str, object], ...]:
    """Read the refusals from the bytes of a quarantine.jsonl.

    Raises:
        IntegrityError: a line is not a refusal, or the last line is cut.
    """
    try:
        if data and not data.endswith(b"\n"):
            raise ValueError("its last line is cut")
        records = tuple(json.loads(line) for line in data.splitlines())
        for record in records:
            if not isinstance(record, dict) or not {"unit", "reason"} <= set(record):
                raise ValueError(f"every line must be an object with unit and reason, found {record}")
    except ValueError as error:
        raise IntegrityError(f"{where} must list the refusals of a release, but: {error}; restore the file") from error
    return records


def printable(name: str) -> str:
    """A name as the release spells it: what is not valid UTF-8 in the name of a file is escaped."""
    return name.encode(errors="backslashreplace").decode()


def count_reasons(rows: Sequence[InventoryRow]) -> dict[str, int]:
    """Refused units by reason, sorted by reason."""
    return dict(sorted(Counter(row.reason for row in rows if row.state == UnitState.REFUSED).items()))
