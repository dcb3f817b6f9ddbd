"""Files that nobody should open, or of which far more is declared than is there."""

import gzip
import io
import os
import socket
import struct
import tarfile
import zlib
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

GIB = 1 << 30
DEEP = b"[" * 100_000 + b"]" * 100_000
DIGITS = b"1" * 5_000


def replaced(name: str, data: bytes) -> Callable[[Path], object]:
    """Other content of one file."""
    return lambda folder: (folder / name).write_bytes(data)


def changed(name: str, change: Callable[[bytes], bytes]) -> Callable[[Path], object]:
    """The content of one file, changed."""
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def pipe(name: str) -> Callable[[Path], object]:
    """A pipe that nobody writes to, in place of a file."""

    def plant(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name)

    return plant


def bound_socket(name: str) -> Callable[[Path], object]:
    """A socket in place of a file; its path is too long for the system unless it is made from within."""

    def plant(folder: Path) -> None:
        path = folder / name
        path.unlink()
        here = os.open(".", os.O_RDONLY)
        os.chdir(path.parent)
        try:
            with socket.socket(socket.AF_UNIX) as one:
                one.bind(path.name)
        finally:
            os.fchdir(here)
            os.close(here)

    return plant


def link(name: str, target: str) -> Callable[[Path], object]:
    """A symbolic link in place of a file."""

    def plant(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(target)

    return plant


def hole(name: str, size: int) -> Callable[[Path], object]:
    """A file of zeros that takes no room on the disk."""

    def plant(folder: Path) -> None:
        with (folder / name).open("wb") as file:
            file.truncate(size)

    return plant


def renamed(old: str, new: str | bytes) -> Callable[[Path], object]:
    """Another name for a file."""
    return lambda folder: (folder / old).rename((folder / old).parent / os.fsdecode(new))


def png_declaring(width: int, height: int) -> bytes:
    """A grey PNG of 16 bits with a sound header and no pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


def jpeg_declaring(width: int, height: int) -> bytes:
    """A JPEG whose frame header declares a size, and nothing else."""
    return (
        b"\xff\xd8\xff\xc0\x00\x11\x08"
        + struct.pack(">HH", height, width)
        + b"\x03"
        + b"\x01\x11\x00" * 3
        + b"\xff\xd9"
    )


def table_of(rows: int) -> bytes:
    """A parquet table of zeros: 20 million rows are a few kilobytes."""
    buffer = io.BytesIO()
    pq.write_table(pa.table({"action": pa.array(bytearray(rows), pa.int8())}), buffer, compression="zstd")
    return buffer.getvalue()


def nested_list(depth: int) -> bytes:
    """A parquet table whose only column is a list in a list, and so on."""
    value: object = 1.0
    for _ in range(depth):
        value = [value]
    buffer = io.BytesIO()
    pq.write_table(pa.table({"action": [value]}), buffer)
    return buffer.getvalue()


def archive_of(*members: tuple[str, bytes], change: Callable[[tarfile.TarInfo], object] = lambda _: None) -> bytes:
    """A plain tar of regular members, each of which `change` may make into something else."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for name, data in members:
            info = tarfile.TarInfo(name)
            info.size = len(data)
            change(info)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def with_sizes_of_8_gib(data: bytes) -> bytes:
    """The first header of a tar, with a sound checksum, declares 8 GiB - 1: as much as octal digits can say."""
    header = bytearray(data[:512])
    header[124:136] = b"77777777777\x00"
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\x00 " % sum(header)
    return bytes(header) + data[512:]


def bomb() -> bytes:
    """8 GiB of zeros as gzip members, 64 MiB each."""
    return gzip.compress(bytes(64 << 20), 1) * 128
