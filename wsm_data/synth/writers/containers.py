"""Files of a scene into a folder or an archive, whole or not at all."""

import shutil
import tarfile
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from zlib_ng import zlib_ng

from wsm_data.files.atomic import atomic_file

Member = tuple[str, bytes]
"""Name relative to the scene, with `/`, and content."""

_BLOCK = 512
_RECORD = 20 * _BLOCK
_GZIP = 31  # zlib's window bits of 15, and 16 for a gzip header, which then has neither name nor time


def write_folder(path: Path, members: Iterable[Member]) -> None:
    """Write all members below `path`, which appears only when it is complete; an older one is replaced.

    The temporary folder always has the same name, so that the next writer of `path` removes what a killed one left; two
    at once are not provided for: a stage's folder has one owner.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.partial_folder")
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir()
        for name, data in members:
            target = temporary / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        if path.exists():
            shutil.rmtree(path)
        temporary.rename(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)  # there is none once it has been renamed


def write_archive(path: Path, top: str, members: Iterable[Member], level: int) -> None:
    """Write all members below the folder `top` of a tar.gz whose bytes depend on nothing but them and the level."""
    with atomic_file(path) as file:
        deflate = zlib_ng.compressobj(level, zlib_ng.DEFLATED, _GZIP)
        written = 0
        for name, data in members:
            written += _add(file, deflate, f"{top}/{name}", data)
        end = _RECORD - written % _RECORD
        padding = end if end >= 2 * _BLOCK else end + _RECORD
        file.write(deflate.compress(bytes(padding)))
        file.write(deflate.flush())


def _add(file: BinaryIO, deflate: "zlib_ng._Compress", name: str, data: bytes) -> int:
    info = tarfile.TarInfo(name)
    info.size, info.mode = len(data), 0o644
    header = info.tobuf(tarfile.USTAR_FORMAT)
    padding = -len(data) % _BLOCK
    file.write(deflate.compress(header))
    file.write(deflate.compress(data))
    file.write(deflate.compress(bytes(padding)))
    return len(header) + len(data) + padding
