"""One shard, read once from front to back in constant memory: digest, clips, end of archive."""

import hashlib
from collections.abc import Callable, Iterator, Sequence

from wsm_data.access.verify_clip import check_clip
from wsm_data.files.stores import Store
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo
from wsm_data.shards.tar_format import END_OF_ARCHIVE

_READ_BYTES = 16 << 20  # one request to a remote store


def verify_shard(
    store: Store,
    shard: ShardInfo,
    rows: Sequence[IndexRow] | None,
    manifest: ReleaseManifest,
    on_progress: Callable[[int], None],
) -> Iterator[Finding]:
    """Find what is wrong with a shard.

    Args:
        store: the release.
        shard: what the manifest says of it.
        rows: its clips by offset, or None where the index cannot say; then only size and digest are checked.
        manifest: the release.
        on_progress: called with the number of bytes just read.
    """
    if not store.exists(shard.name):
        message = f"the shard of {shard.clips} clips must be at {store.root}, but is missing; fetch it again"
        yield Finding(kind=FindingKind.SHARD_MISSING, shard=shard.name, message=message)
        return
    reader = _HashingReader(store, shard.name, on_progress)
    if rows is not None:
        yield from _clips(reader, shard, rows, manifest)
    yield from _totals(reader, shard, rows)


class _HashingReader:
    """Reads a file forward in large blocks, and hashes all of it."""

    def __init__(self, store: Store, name: str, on_progress: Callable[[int], None]):
        self.position = 0
        self._store, self._name, self._on_progress = store, name, on_progress
        self._digest = hashlib.sha256()
        self._block = memoryview(b"")
        self._fetched = 0
        self._size = store.size_bytes(name)

    def read(self, size: int) -> memoryview:
        """The next `size` bytes, fewer at the end of the file; without a copy where they lie in one block."""
        parts = []
        missing = size
        while missing and (self._block or self._fetch()):
            parts.append(self._block[:missing])
            self._block = self._block[missing:]
            missing -= len(parts[-1])
        self.position += size - missing
        return parts[0] if len(parts) == 1 else memoryview(b"".join(parts))

    def skip(self, size: int | None = None) -> None:
        """Pass over `size` bytes, or over all that is left; they are hashed like the others."""
        while size != 0 and (self._block or self._fetch()):
            passed = self._block[:size]
            self._block = self._block[len(passed) :]
            self.position += len(passed)
            size = None if size is None else size - len(passed)

    def hexdigest(self) -> str:
        """sha256 of what was fetched."""
        return self._digest.hexdigest()

    def _fetch(self) -> bool:
        if self._fetched >= self._size:  # some stores fail where a range starts at the end
            return False
        data = self._store.read_range(self._name, self._fetched, _READ_BYTES)
        self._digest.update(data)
        self._fetched += len(data)
        self._block = memoryview(data)
        self._on_progress(len(data))
        return bool(data)


def _clips(
    reader: _HashingReader, shard: ShardInfo, rows: Sequence[IndexRow], manifest: ReleaseManifest
) -> Iterator[Finding]:
    end = 0
    for number, row in enumerate(rows):
        if (row.clip_offset, row.position, row.split) != (end, number, shard.split):
            message = (
                f"clip {number} of a shard of split {shard.split} must start at byte {end}; the index has position "
                f"{row.position}, byte {row.clip_offset} and split {row.split}; restore the index or pack again"
            )
            yield Finding(kind=FindingKind.SHARD_LAYOUT, shard=shard.name, clip=row.key, message=message)
        if row.clip_offset >= end:  # else two clips overlap, which has been said
            reader.skip(row.clip_offset - end)
            yield from check_clip(reader.read(row.clip_size), row, manifest)
            end = row.clip_offset + row.clip_size
    found = reader.read(len(END_OF_ARCHIVE))
    if found != END_OF_ARCHIVE and reader.position >= end:
        message = f"the clips must be followed by {len(END_OF_ARCHIVE)} zero bytes at {end}, found other bytes or fewer"
        yield Finding(kind=FindingKind.SHARD_END, shard=shard.name, message=f"{message}; fetch the shard again")


def _totals(reader: _HashingReader, shard: ShardInfo, rows: Sequence[IndexRow] | None) -> Iterator[Finding]:
    reader.skip()
    if rows is not None and len(rows) != shard.clips:
        message = f"the shard must hold {shard.clips} clips, the index has {len(rows)}; restore the index or pack again"
        yield Finding(kind=FindingKind.COUNT, shard=shard.name, message=message)
    if reader.position != shard.bytes:
        message = f"the shard must have {shard.bytes} bytes, found {reader.position}; fetch it again"
        yield Finding(kind=FindingKind.SHARD_SIZE, shard=shard.name, message=message)
    if reader.hexdigest() != shard.sha256:
        message = f"the shard must have sha256 {shard.sha256}, found {reader.hexdigest()}; fetch it again"
        yield Finding(kind=FindingKind.SHARD_CHANGED, shard=shard.name, message=message)
