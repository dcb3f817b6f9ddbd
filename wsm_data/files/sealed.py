"""JSON objects that carry a checksum of themselves: a changed byte is found by whoever reads them."""

from collections.abc import Mapping
from typing import Any

from wsm_data.files.digest import xxh3_128
from wsm_data.files.jsonlines import canonical_json

SEAL = "xxh3"


def sealed(record: Mapping[str, Any]) -> dict[str, Any]:
    """The object with its checksum, over its canonical spelling, as one more member."""
    return {**record, SEAL: xxh3_128(canonical_json(record).encode())}


def unsealed(record: object) -> dict[str, Any]:
    """Inverse of `sealed`.

    Raises:
        ValueError: it is no such object, or was changed since it was sealed.
    """
    if not isinstance(record, dict) or SEAL not in record:
        raise ValueError(f"it must be an object with the checksum {SEAL!r}")
    plain = {name: value for name, value in record.items() if name != SEAL}
    if sealed(plain) != record:
        raise ValueError("it was changed since it was written")
    return plain
