"""The text header of a PLY file: which elements follow, how many, and of which properties."""

from dataclasses import dataclass

from wsm_data.errors import DataError, Reason

_MAX_HEADER_BYTES = 1 << 16
_END = b"\nend_header"

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
"""numpy codes of the PLY property types, under both of their spellings."""


@dataclass(frozen=True, slots=True)
class PlyElement:
    """A table of the file.

    Attributes:
        name: `vertex`, `face`, ...
        count: rows, as the header promises.
        properties: (name, numpy type code) of each scalar; None for the type of a list.
        smallest_row_bytes: bytes of a row in a binary file at least; lists count as empty.
    """

    name: str
    count: int
    properties: tuple[tuple[str, str | None], ...]
    smallest_row_bytes: int

    @property
    def has_lists(self) -> bool:
        """Whether rows have no fixed size."""
        return any(code is None for _, code in self.properties)


@dataclass(frozen=True, slots=True)
class PlyHeader:
    """The header.

    Attributes:
        encoding: `ascii`, `binary_little_endian` or `binary_big_endian`.
        elements: in the order they are stored.
        body_start: offset of the first byte after the header.
    """

    encoding: str
    elements: tuple[PlyElement, ...]
    body_start: int

    def smallest_body_bytes(self) -> int:
        """Bytes that the promised rows need at least; in ASCII a digit and a separator each."""
        if self.encoding == "ascii":
            return sum(element.count * 2 * len(element.properties) for element in self.elements)
        return sum(element.count * element.smallest_row_bytes for element in self.elements)


def parse_ply_header(data: memoryview) -> PlyHeader:
    """Read the header, and compare what it promises with the bytes that are there, before anything is allocated.

    Raises:
        DataError: `cloud.unreadable` when it is no PLY file; `cloud.header` when the header is malformed or promises
            more than the file holds.
    """
    if bytes(data[:4]) not in (b"ply\n", b"ply\r"):
        raise DataError(Reason.CLOUD_UNREADABLE, f"a PLY file starts with 'ply', found {bytes(data[:4])!r}")
    head = bytes(data[:_MAX_HEADER_BYTES])
    newline = head.find(b"\n", head.find(_END) + 1) if _END in head else -1
    if newline < 0:
        raise _malformed(f"it has no end_header within {min(len(data), _MAX_HEADER_BYTES)} bytes")
    lines = [line.split() for line in head[:newline].decode("ascii", "replace").splitlines()[1:-1]]
    header = _parse_lines([line for line in lines if line and line[0] not in ("comment", "obj_info")], newline + 1)
    needed, held = header.smallest_body_bytes(), len(data) - header.body_start
    if needed > held:
        raise DataError(
            Reason.CLOUD_HEADER,
            f"the header promises rows of at least {needed} bytes, the file holds {held} after it: it was cut, or the "
            "count is wrong; download it again",
            {"promised_bytes": needed, "held_bytes": held},
        )
    return header


def _parse_lines(lines: list[list[str]], body_start: int) -> PlyHeader:
    encoding = ""
    names: list[str] = []
    counts: list[int] = []
    properties: list[list[tuple[str, str | None, int]]] = []
    for words in lines:
        match words:
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as kind, "1.0"]:
                encoding = kind
            case ["element", name, count] if count.isdecimal() and len(count) < 20:
                names.append(name)
                counts.append(int(count))
                properties.append([])
            case ["property", "list", length, item, name] if properties and length in TYPES and item in TYPES:
                properties[-1].append((name, None, int(TYPES[length][1])))
            case ["property", kind, name] if properties and kind in TYPES:
                properties[-1].append((name, TYPES[kind], int(TYPES[kind][1])))
            case _:
                raise _malformed(f"the line {' '.join(words)[:80]!r} cannot be read")
    if not encoding:
        raise _malformed("it has no format line")
    elements = tuple(
        PlyElement(name, count, tuple((field, code) for field, code, _ in rows), sum(size for *_, size in rows))
        for name, count, rows in zip(names, counts, properties, strict=True)
    )
    return PlyHeader(encoding, elements, body_start)


def _malformed(what: str) -> DataError:
    return DataError(Reason.CLOUD_HEADER, f"the PLY header is malformed: {what}; download it again")
