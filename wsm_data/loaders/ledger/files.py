"""The files of a ledger: one a rank and process, each a sequence of frames.

A frame is a tag of four letters, the size of the payload (uint32), the payload, and the xxh3_64 of all that (uint64),
little-endian. `SESS` comes first: JSON of who writes. `STRT` says that steps follow from (epoch, step) on, and how many
the epoch has; `STEP` says which clips one step brought; `DONE` that the writer was closed. What a killed writer leaves
behind the last whole frame is recognised and passed over; any other damage is refused. A frame whose size was changed
so that it reaches past the end looks like one that was cut short: it is refused where a whole frame follows, and the
last frame of a file alone can be lost in this way, which counts as torn.
"""

import json
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xxhash
from numpy.typing import NDArray

from wsm_data.errors import IntegrityError

LEDGER_VERSION = 1
SESSION, START, STEP, DONE = b"SESS", b"STRT", b"STEP", b"DONE"
HEAD = struct.Struct("<4sI")
CHECKSUM = struct.Struct("<Q")
START_FIELDS = struct.Struct("<qqq")
STEP_FIELDS = struct.Struct("<qq")
_MAX_PAYLOAD_BYTES = 1 << 28  # a size beyond it is damage, not a frame that was cut
_TAG = re.compile(b"(?=SESS|STRT|STEP|DONE)")
_FILE_NAME = re.compile(r"rank-([0-9]{5,})-([0-9]{6,})\.ledger")


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """Steps that one rank recorded one after the other, from one start on.

    Attributes:
        epoch: the epoch.
        start: step it starts from.
        steps: steps the whole epoch has.
        refs: refs of the steps start, start + 1, ... as they were delivered; int64 [N] each.
    """

    epoch: int
    start: int
    steps: int
    refs: tuple[NDArray[np.int64], ...]

    @property
    def end(self) -> int:
        """The step after the last recorded one."""
        return self.start + len(self.refs)


@dataclass(frozen=True, kw_only=True, eq=False)
class LedgerFile:
    """What one process recorded.

    Attributes:
        path: the file.
        session: id of the process's session.
        identity: what decides the order, as JSON.
        rank: its rank.
        world_size: number of ranks.
        segments: in the order in which they were recorded.
        closed: whether the writer was closed; otherwise it was killed, or still writes.
        torn_bytes: bytes behind the last whole frame: of one that was not written to its end.
    """

    path: Path
    session: str
    identity: Mapping[str, Any]
    rank: int
    world_size: int
    segments: tuple[Segment, ...]
    closed: bool
    torn_bytes: int


def framed(tag: bytes, payload: bytes) -> bytes:
    """A frame: tag, size, payload, checksum."""
    data = HEAD.pack(tag, len(payload)) + payload
    return data + CHECKSUM.pack(xxhash.xxh3_64_intdigest(data))


def file_name(rank: int, number: int) -> str:
    """Name of the file that is number `number` of a rank's."""
    return f"rank-{rank:05d}-{number:06d}.ledger"


def ledger_files(folder: Path) -> dict[tuple[int, int], Path]:
    """The files of a ledger by (rank, number), in that order: the processes of a rank by number, without a clock."""
    paths = list(folder.iterdir()) if folder.is_dir() else []
    named = [(match, path) for path in paths if (match := _FILE_NAME.fullmatch(path.name))]
    return dict(sorted(((int(match[1]), int(match[2])), path) for match, path in named))


def read_session(path: Path) -> dict[str, Any] | None:
    """The head of a file; None where its writer was killed before the head was whole.

    Raises:
        IntegrityError: it is damaged, or of another version.
    """
    with path.open("rb") as file:
        data = file.read(HEAD.size)
        if len(data) == HEAD.size:
            data += file.read(min(HEAD.unpack(data)[1], _MAX_PAYLOAD_BYTES) + CHECKSUM.size)
    return _session(memoryview(data), path)


def read_ledger_file(path: Path) -> LedgerFile | None:
    """All of a file; None where its writer was killed before the head was whole.

    Raises:
        IntegrityError: it is damaged other than by a kill, or of another version.
    """
    data = memoryview(path.read_bytes())
    session = _session(data, path)
    if session is None:
        return None
    segments: list[tuple[tuple[int, int, int], list[NDArray[np.int64]]]] = []
    tag, place = SESSION, 0
    while (frame := _frame_at(data, place, path)) is not None:
        tag, payload = frame
        if tag == START:
            segments.append((START_FIELDS.unpack(payload), []))
        elif tag == STEP:
            _add_step(segments, payload, path, place)
        place += HEAD.size + len(payload) + CHECKSUM.size
    return LedgerFile(
        path=path,
        session=session["session"],
        identity=session["identity"],
        rank=session["rank"],
        world_size=session["world_size"],
        segments=tuple(
            Segment(epoch=epoch, start=start, steps=steps, refs=tuple(refs)) for (epoch, start, steps), refs in segments
        ),
        closed=tag == DONE,
        torn_bytes=len(data) - place,
    )


def _add_step(
    segments: list[tuple[tuple[int, int, int], list[NDArray[np.int64]]]], payload: memoryview, path: Path, place: int
) -> None:
    epoch, step = STEP_FIELDS.unpack(payload[: STEP_FIELDS.size])
    (begun, start, steps), refs = segments[-1] if segments else ((-1, 0, 0), [])
    if (epoch, step) != (begun, start + len(refs)) or step >= steps:
        raise IntegrityError(
            f"{path}: at byte {place} step {start + len(refs)} of epoch {begun} must follow, found step {step} of "
            f"epoch {epoch}; restore the file"
        )
    refs.append(np.frombuffer(payload[STEP_FIELDS.size :], "<i8"))


def _session(data: memoryview, path: Path) -> dict[str, Any] | None:
    frame = _frame_at(data, 0, path)
    if frame is None:
        return None
    tag, payload = frame
    session = json.loads(bytes(payload)) if tag == SESSION else {}
    if session.get("version") != LEDGER_VERSION:
        raise IntegrityError(
            f"{path} must start with the head of a ledger of version {LEDGER_VERSION}, found "
            f"{session.get('version', 'none')}; restore the file or use a matching wsm"
        )
    return dict(session)


def _frame_at(data: memoryview, place: int, path: Path) -> tuple[bytes, memoryview] | None:
    """Tag and payload of the frame at a byte; None at the end, also where only a part of a frame follows.

    Zeros count as not written: a file system leaves them for blocks it had not written when power failed.
    """
    rest = data[place:]
    if (frame := _whole_frame(rest)) is not None:
        return frame
    is_cut = len(bytes(rest).rstrip(b"\0")) < _stated_bytes(rest)
    if is_cut and not any(_whole_frame(rest[match.start() :]) for match in _TAG.finditer(rest, 1)):
        return None
    raise IntegrityError(
        f"{path}: the record at byte {place} must have the size and the checksum it was written with, found other "
        "bytes; restore the file"
    )


def _stated_bytes(data: memoryview) -> int:
    """Bytes of a whole frame that begins as `data` does; of one without payload where its head cannot be believed."""
    tag, size = HEAD.unpack(data[: HEAD.size]) if len(data) >= HEAD.size else (b"", 0)
    if tag not in (SESSION, START, STEP, DONE) or size > _MAX_PAYLOAD_BYTES:
        size = 0
    return HEAD.size + int(size) + CHECKSUM.size


def _whole_frame(data: memoryview) -> tuple[bytes, memoryview] | None:
    """Tag and payload of the frame that `data` begins with; None where there is none with the right checksum."""
    end = _stated_bytes(data) - CHECKSUM.size
    if len(data) < end + CHECKSUM.size:
        return None
    if CHECKSUM.unpack(data[end : end + CHECKSUM.size])[0] != xxhash.xxh3_64_intdigest(data[:end]):
        return None
    return bytes(data[:4]), data[HEAD.size : end]
