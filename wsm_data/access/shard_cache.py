"""A folder of whole shards that never holds more bytes than allowed, shared by any number of processes.

A shard stands at `<folder>/<digest of the release>/<shard>`. It gets that name only after its sha256 was found to be
the manifest's and its bytes are on disk, so a name of the right size is believed without reading it again, also after a
restart: hashing tens of gigabytes at every start would cost minutes, and what a disk does to a file later is noticed by
the checksums of the members that a loader compares anyway.

A shard that is being downloaded stands beside it as `.<shard>.partial`, at its full size from the beginning. So the
sizes of the files are the account: no other book is kept that a killed process could leave wrong.

Locks are `flock`s, which vanish with their process:
- `<folder>/.lock`, exclusive, for as long as room is made and taken, or a download gets its name;
- the partial file, exclusive, for as long as it is written. A partial file that nobody holds was left by a killed
  process: it is overwritten or removed, never believed;
- a shard, shared, while it is read. It is removed only by who gets it exclusively, so that the space of a removed shard
  is free at once.
"""

import fcntl
import os
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum, auto
from io import FileIO
from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.files.atomic import TEMPORARY_SUFFIX, flush_folder

_GIB = 1 << 30
_LOCK_NAME = ".lock"


@dataclass(frozen=True, kw_only=True)
class CachedShard:
    """One shard as the manifest of its release knows it.

    Attributes:
        digest: digest of the release.
        name: file name.
        bytes: size.
        sha256: digest of the file, in hexadecimal.
    """

    digest: str
    name: str
    bytes: int
    sha256: str


class Refusal(Enum):
    """Why a shard cannot be downloaded now."""

    PRESENT = auto()
    UNDERWAY = auto()  # another process or thread is downloading it
    NO_ROOM = auto()


@dataclass(frozen=True)
class _File:
    path: Path
    bytes: int
    used_ns: int


class ShardCache:
    """The files of the cache; knows nothing of stores."""

    def __init__(self, folder: Path, limit_bytes: int):
        self._folder = folder
        self._limit_bytes = limit_bytes
        folder.mkdir(parents=True, exist_ok=True)

    def require_room_for(self, shards: Collection[CachedShard]) -> None:
        """Refuse a limit under which not even one of these shards could be held.

        Raises:
            ConfigError: says the least limit.
        """
        largest = max(shards, key=lambda shard: shard.bytes, default=None)
        if largest is not None and largest.bytes > self._limit_bytes:
            raise ConfigError(
                f"cache_gib must be at least {largest.bytes / _GIB:.6f} to hold {largest.name} of {largest.bytes} "
                f"bytes, found {self._limit_bytes / _GIB:.6f}; to fetch ahead it must hold several shards"
            )

    @contextmanager
    def opened(self, shard: CachedShard) -> Iterator[int | None]:
        """Descriptor of the shard, which cannot be removed meanwhile; None where the cache does not have it."""
        try:
            descriptor = os.open(self._path(shard), os.O_RDONLY)
        except FileNotFoundError:
            yield None
            return
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            found = os.fstat(descriptor)
            is_whole = found.st_nlink > 0 and found.st_size == shard.bytes
            if is_whole:
                os.utime(descriptor, ns=(time.time_ns(), found.st_mtime_ns))  # for the order of eviction
            yield descriptor if is_whole else None
        finally:
            os.close(descriptor)

    def begin(self, shard: CachedShard, keep: Collection[CachedShard], must: bool) -> "Download | Refusal":
        """Reserve room for a shard, and remove as many of the least recently used ones as that takes.

        Args:
            shard: what is to be downloaded.
            keep: shards that should stay.
            must: remove those too where nothing else is left.
        """
        path = self._path(shard)
        partial = path.with_name(f".{shard.name}{TEMPORARY_SUFFIX}")
        with self.locked():
            found = _status(path)
            if found is not None and found.st_size == shard.bytes:
                os.utime(path, ns=(time.time_ns(), found.st_mtime_ns))  # it is wanted: others should not evict it first
                return Refusal.PRESENT
            path.parent.mkdir(exist_ok=True)
            file = FileIO(os.open(partial, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644), "r+b")
            if not _try_lock(file.fileno()):
                file.close()
                return Refusal.UNDERWAY
            path.unlink(missing_ok=True)  # of another size, so it is not what was put there
            file.truncate(0)
            if not self._make_room(shard.bytes, {self._path(other) for other in keep}, must):
                partial.unlink()
                file.close()
                return Refusal.NO_ROOM
            file.truncate(shard.bytes)
        return Download(self, file, partial, path)

    def remove(self, shard: CachedShard) -> None:
        """Remove a shard whose bytes turned out to be wrong; those who have it open may read on."""
        with self.locked():  # else who makes room could find it gone between two looks at it
            self._path(shard).unlink(missing_ok=True)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Nobody makes or takes room meanwhile."""
        with (self._folder / _LOCK_NAME).open("ab") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield

    def _path(self, shard: CachedShard) -> Path:
        return self._folder / shard.digest / shard.name

    def _make_room(self, needed: int, keep: set[Path], must: bool) -> bool:
        shards = sorted(self._files("*.tar"), key=lambda file: (file.path in keep, file.used_ns))
        removable = [file for file in shards if must or file.path not in keep]
        free = self._limit_bytes - needed - sum(file.bytes for file in (*shards, *self._partials()))
        if free + sum(file.bytes for file in removable) < 0:
            return False
        for file in removable:
            if free >= 0:
                break
            if _remove_unless_held(file.path):
                free += file.bytes
        return free >= 0

    def _partials(self) -> list[_File]:
        """What is being downloaded, after those files are gone that killed processes left."""
        for file in self._files(f".*.tar{TEMPORARY_SUFFIX}"):
            _remove_unless_held(file.path)
        return list(self._files(f".*.tar{TEMPORARY_SUFFIX}"))

    def _files(self, pattern: str) -> Iterator[_File]:
        for path in self._folder.glob(f"*/{pattern}"):
            found = _status(path)
            if found is not None:
                yield _File(path, found.st_size, found.st_atime_ns)


class Download:
    """Room for one shard, written from front to back; a context that gives the room back unless it was finished.

    Until the end of the context nobody can remove the shard: whoever downloaded it gets to read it, however many others
    want its room.
    """

    def __init__(self, cache: ShardCache, file: FileIO, partial: Path, path: Path):
        self._cache, self._file, self._partial, self._path = cache, file, partial, path
        self._position = 0
        self._is_finished = False

    def __enter__(self) -> "Download":
        return self

    def __exit__(self, *raised: object) -> None:
        with self._cache.locked():
            if not self._is_finished:
                self._partial.unlink()
            self._file.close()

    @property
    def descriptor(self) -> int:
        """Of the open file."""
        return self._file.fileno()

    def restart(self) -> None:
        """Write from the beginning again."""
        self._position = 0

    def write(self, data: memoryview) -> None:
        """Append bytes."""
        while data:
            count = os.pwrite(self.descriptor, data, self._position)
            self._position += count
            data = data[count:]

    def finish(self) -> None:
        """Bring the bytes to disk, and give the shard its name: from now on it is believed."""
        os.fsync(self.descriptor)
        with self._cache.locked():  # else `begin` could open the partial file and truncate what has become the shard
            self._partial.rename(self._path)
            self._is_finished = True
        flush_folder(self._path.parent)


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _remove_unless_held(path: Path) -> bool:
    """Remove a file that nobody reads or writes; whether it was removed."""
    with path.open("r+b") as file:
        is_free = _try_lock(file.fileno())
        if is_free:
            path.unlink()
    return is_free
