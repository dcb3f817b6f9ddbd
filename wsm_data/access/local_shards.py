"""Shards on this machine: scattered reads straight into the caller's memory, without a copy in between."""

import os
import threading
import weakref
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path

from wsm_data.access.shard_reader import Span, missing_shard, short_shard

MAX_OPEN_FILES = 128
"""Shards that are kept open. Opening one costs some 10 us, a limit of 1,024 files a process is common."""

_MAX_BUFFERS = 1024  # IOV_MAX of Linux and macOS


class LocalShards:
    """Reads shards of a folder with `preadv`; see `ShardReader`."""

    def __init__(self, root: str, max_open_files: int = MAX_OPEN_FILES):
        self._root = root
        self._max_open_files = max_open_files
        self._lock = threading.Lock()
        self._files: OrderedDict[str, _File] = OrderedDict()

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        """Fill the buffers one after the other with the shard's bytes from `offset` on.

        Raises:
            IntegrityError: the shard is missing, or ends before the last buffer is full; names the shard.
            OSError: the system refuses to read.
        """
        file = self._open(shard)
        wanted = Span(shard, offset, sum(buffer.nbytes for buffer in buffers))
        try:
            read = read_scattered(file.descriptor, offset, buffers)
        except OSError as error:  # an open file does not know its name
            raise OSError(error.errno, error.strerror, f"{self._root}/{shard}") from error
        if read < wanted.size:
            raise short_shard(self._root, wanted, os.fstat(file.descriptor).st_size)

    def expect(self, spans: Sequence[Span]) -> None:
        """Nothing: the system reads ahead."""

    def forget(self, shard: str) -> None:
        """Close the shard: the next reading opens what has its name then."""
        with self._lock:
            self._files.pop(shard, None)

    def close(self) -> None:
        """Close all files that no thread is reading, and the others when it is done."""
        with self._lock:
            self._files.clear()

    def _open(self, shard: str) -> "_File":
        with self._lock:
            file = self._files.get(shard)
            if file is None:
                try:
                    file = self._files[shard] = _File(Path(self._root) / shard)
                except FileNotFoundError as error:
                    raise missing_shard(self._root, shard) from error
                if len(self._files) > self._max_open_files:
                    self._files.popitem(last=False)
            else:
                self._files.move_to_end(shard)
            return file


class _File:
    """An open file that is closed when nobody refers to it any more: never under a thread that reads from it."""

    def __init__(self, path: Path):
        self.descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        weakref.finalize(self, os.close, self.descriptor)


def read_scattered(descriptor: int, offset: int, buffers: Sequence[memoryview]) -> int:
    """Fill byte buffers one after the other from an open file; returns the bytes read, fewer only where it ends.

    Raises:
        OSError: the system refuses to read.
    """
    left = [buffer for buffer in buffers if buffer.nbytes]
    begin, end = offset, offset + sum(buffer.nbytes for buffer in left)
    while left:
        count = os.preadv(descriptor, left[:_MAX_BUFFERS], offset)
        offset += count
        left = _after(left, count) if count and offset < end else []
    return offset - begin


def _after(buffers: Sequence[memoryview], count: int) -> list[memoryview]:
    """What is left of the buffers behind their first `count` bytes."""
    left: list[memoryview] = []
    for buffer in buffers:
        if count < buffer.nbytes:
            left.append(buffer[count:])
        count = max(0, count - buffer.nbytes)
    return left
