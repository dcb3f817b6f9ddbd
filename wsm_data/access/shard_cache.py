"""A folder of whole shards that never holds more bytes than allowed, shared by any number of processes.

A shard stands at `<folder>/<digest of the release>/<shard>`. It gets that name when its sha256 was the manifest's and
its bytes are on disk, so a name of the right size is believed without reading it again, also after a restart. While it
is downloaded it stands beside it as `.<shard>.partial`, at its full size from the beginning: the sizes of the files are
the account, and no process that is killed can leave it wrong.

Names change under the lock of `<folder>/.lock` alone. A partial file is locked for as long as it is written; one that
nobody holds was left by a killed process, and is overwritten or removed.
"""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from wsm_data.files.atomic import TEMPORARY_SUFFIX, flush_folder
from wsm_data.shards.manifest import ShardInfo
from wsm_data.shards.names import is_shard_name


class ShardCache:
    """The shards of one release in a cache; others may share its folder."""

    def __init__(self, folder: Path, release_digest: str, limit_bytes: int):
        self._folder, self._own, self._limit_bytes = folder, folder / release_digest, limit_bytes
        folder.mkdir(parents=True, exist_ok=True)

    def has(self, shard: ShardInfo) -> bool:
        """Whether the shard is here; to be asked for keeps it from being the next one that is removed."""
        path = self._path(shard)
        try:
            found = path.stat()
            os.utime(path, ns=(time.time_ns(), found.st_mtime_ns))
        except FileNotFoundError:
            return False
        return found.st_size == shard.bytes

    @contextmanager
    def opened(self, shard: ShardInfo) -> Iterator[BinaryIO | None]:
        """The shard, which may be read to its end even when it is removed meanwhile; None where it is not here."""
        try:
            file = self._path(shard).open("rb") if self.has(shard) else None
        except FileNotFoundError:
            file = None
        try:
            yield file
        finally:
            if file is not None:
                file.close()

    @contextmanager
    def reserved(self, shard: ShardInfo) -> Iterator[BinaryIO | None]:
        """Room for a shard, which gets its name at the end of the context; where that fails, the room is given back.

        None where the shard is here, somebody else downloads it, or downloads of others hold the room.
        """
        path = self._path(shard)
        partial = path.with_name(f".{path.name}{TEMPORARY_SUFFIX}")
        with self._locked():
            file = None if self.has(shard) else self._begin(partial, shard.bytes)
        if file is None:
            yield None
            return
        is_whole = False
        try:
            yield file
            file.flush()
            os.fsync(file.fileno())
            is_whole = True
        finally:
            with self._locked(), file:
                if is_whole:
                    partial.rename(path)
                else:
                    partial.unlink()
        flush_folder(path.parent)

    def remove(self, shard: ShardInfo) -> None:
        """Remove a shard whose bytes turned out to be wrong."""
        with self._locked():
            self._path(shard).unlink(missing_ok=True)

    def _path(self, shard: ShardInfo) -> Path:
        return self._own / shard.name

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with (self._folder / ".lock").open("ab") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield

    def _begin(self, partial: Path, size: int) -> BinaryIO | None:
        partial.parent.mkdir(exist_ok=True)
        file = os.fdopen(os.open(partial, os.O_RDWR | os.O_CREAT, 0o644), "r+b")
        if not _is_free(file):
            file.close()
            return None
        file.truncate(0)
        if not self._make_room(size):
            partial.unlink()
            file.close()
            return None
        file.truncate(size)
        return file

    def _make_room(self, size: int) -> bool:
        """Remove what killed processes left, and the shards used least recently, as many as that takes."""
        for partial in self._folder.glob(f"*/.*.tar{TEMPORARY_SUFFIX}"):
            with partial.open("r+b") as file:
                if _is_free(file):
                    partial.unlink()
                else:
                    size += partial.stat().st_size
        shards = {path: path.stat() for path in self._folder.glob("*/*.tar") if is_shard_name(path.name)}
        if size > self._limit_bytes:
            return False
        size += sum(found.st_size for found in shards.values())
        for path in sorted(shards, key=lambda path: shards[path].st_atime_ns):
            if size > self._limit_bytes:
                path.unlink(missing_ok=True)
                size -= shards[path].st_size
        return True


def _is_free(file: BinaryIO) -> bool:
    """Lock a file that nobody has locked."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
