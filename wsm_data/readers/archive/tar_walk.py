"""One sequential pass over a tar, at the speed of the decompressor: nothing is extracted, nothing sought."""

from collections.abc import Callable, Iterator
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.member import Member
from wsm_data.readers.archive.tar_header import BLOCK_BYTES, ZERO_BLOCK, TarHeader, long_name, parse_header, parse_pax
from wsm_data.readers.archive.tar_stream import TarStream, open_tar
from wsm_data.readers.unreadable import too_large

_MAX_RECORD_BYTES = 1 << 20


def walk_tar(path: Path, where: str, wanted: Callable[[str], bool], max_bytes: int) -> Iterator[Member]:
    """Yield the plain files of a tar that are wanted, in the order they are stored.

    Every header is checked whether its file is wanted or not, and a walk that is not broken off ends only after the
    end marker and the checksum of the compression were seen: members that came before can be trusted from then on.

    Args:
        path: the archive.
        where: what to call it in messages.
        wanted: of a member's name, whether its content is asked for.
        max_bytes: larger ones are members with a refusal, and passed over.

    Raises:
        DataError: `file.unreadable`, or one of the `archive.*` reasons: a pointer file, of a form that is not read,
            truncated anywhere, corrupt, or a member that is a link, a device or of an unknown kind, or whose path is
            absolute or climbs with `..`.
    """
    with open_tar(path, where) as stream:
        pax_global: dict[str, str] = {}
        while (header := _next_header(stream, where, pax_global)) is not None:
            is_file = header.is_file
            _require_safe(header, is_file, where)
            stored = header.size + -header.size % BLOCK_BYTES
            if is_file and wanted(header.name) and header.size > max_bytes:
                refusal = too_large(f"{where}:{header.name}", header.size, max_bytes)
                stream.skip(stored)
                yield Member(header.name, 0, memoryview(b""), refusal)
            elif is_file and wanted(header.name):
                yield Member(header.name, header.size, stream.take(stored)[: header.size])
            else:
                stream.skip(stored)
        _require_end(stream, where)


def _next_header(stream: TarStream, where: str, pax_global: dict[str, str]) -> TarHeader | None:
    """The next real member, with long names and pax records applied; None at the end marker."""
    overrides = dict(pax_global)
    while True:
        block = stream.take(BLOCK_BYTES)
        if block == ZERO_BLOCK:
            return None
        header = parse_header(block, where)
        if header.is_long_name:
            overrides["path"] = long_name(_record(stream, header, where))
        elif header.is_pax:
            records = parse_pax(_record(stream, header, where), where)
            (pax_global if header.is_global else overrides).update(records)
            overrides = {**pax_global, **overrides}
        elif header.is_long_link:
            _record(stream, header, where)
        else:
            return _overridden(header, overrides, where)


def _record(stream: TarStream, header: TarHeader, where: str) -> bytes:
    if not 0 <= header.size <= _MAX_RECORD_BYTES:
        message = f"{where}: a name or pax record must be smaller than 1 MiB, found {header.size} bytes"
        raise DataError(Reason.ARCHIVE_CORRUPT, f"{message}; download it again", {"size_bytes": header.size})
    content = bytes(stream.take(header.size))
    stream.skip(-header.size % BLOCK_BYTES)
    return content


def _overridden(header: TarHeader, overrides: dict[str, str], where: str) -> TarHeader:
    if not overrides and header.size >= 0:
        return header
    if any(key.startswith("GNU.sparse.") for key in overrides):
        raise _unsafe(header.name, "is stored sparse", where, "pack it anew without `--sparse`")
    size = overrides.get("size", str(header.size))
    if not (size.isdecimal() and len(size) <= 19):  # a negative size would walk backwards
        raise DataError(Reason.ARCHIVE_CORRUPT, f"{where}: {header.name} has the size {size[:40]!r}; download it again")
    return TarHeader(overrides.get("path", header.name), int(size), header.kind)


def _require_safe(header: TarHeader, is_file: bool, where: str) -> None:
    if header.is_hard_link:
        how = "pack it anew with `tar --hard-dereference -czf`, which stores the file under each of its names"
        raise _unsafe(header.name, "is a hard link to another", where, how)
    if header.kind == b"S":
        raise _unsafe(header.name, "is stored sparse", where, "pack it anew without `--sparse`")
    if not (is_file or header.is_folder or header.is_label):
        raise _unsafe(header.name, f"is a link, a device or of an unknown kind ({header.kind!r})", where)
    if header.name.startswith("/"):
        raise _unsafe(header.name, "has an absolute path", where)
    if ".." in header.name and ".." in header.name.split("/"):
        raise _unsafe(header.name, "climbs out of the archive with '..'", where)


def _unsafe(name: str, what: str, where: str, advice: str = "do not use this archive") -> DataError:
    message = f"{where}: members must be plain files and folders below the scene, but {name!r} {what}"
    return DataError(Reason.ARCHIVE_UNSAFE_MEMBER, f"{message}; {advice}", {"member": name})


def _require_end(stream: TarStream, where: str) -> None:
    """Two zero blocks end a tar and zeros fill it up; one alone is what a cut leaves."""
    if stream.take(BLOCK_BYTES) != ZERO_BLOCK:
        raise DataError(
            Reason.ARCHIVE_CORRUPT, f"{where}: a single zero block stands between members; download it again"
        )
    for piece in stream.rest():
        if bytes(piece).strip(b"\0"):
            raise DataError(
                Reason.ARCHIVE_CORRUPT, f"{where}: there is data behind the end of the tar; download it again"
            )
