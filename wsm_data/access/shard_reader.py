"""How the bytes of shards reach memory that the caller owns: the one thing local and remote readers have in common."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from wsm_data.errors import IntegrityError


@dataclass(frozen=True)
class Span:
    """A stretch of a shard.

    Attributes:
        shard: file name of the shard.
        offset: first byte.
        size: number of bytes.
    """

    shard: str
    offset: int
    size: int

    @property
    def end(self) -> int:
        """First byte behind the stretch."""
        return self.offset + self.size


class ShardReader(Protocol):
    """Reads stretches of the shards of one release. Safe to be used by several threads at the same time."""

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        """Fill writable byte buffers, one after the other, with the shard's bytes from `offset` on.

        Nothing is kept of `buffers` after the call. What they hold after an error is undefined.

        Args:
            shard: file name of the shard.
            offset: first byte.
            buffers: contiguous views of bytes (`format` is "B"); empty ones are allowed.

        Raises:
            IntegrityError: the shard is missing, or ends before the last buffer is full; names the shard.
            OSError: the system refuses to read.
            StoreError: the store refuses, or failed in all attempts; names the object.
        """

    def expect(self, spans: Sequence[Span]) -> None:
        """Say what will be read next, in this order, so that a slow store can be asked in advance.

        A hint: what was announced may never be read, and what is read may never have been announced.
        """

    def forget(self, shard: str) -> None:
        """Let go of what is kept of a shard, because bytes that were read from it are not what they should be.

        The next reading opens the file again, or asks the store.
        """

    def close(self) -> None:
        """Give back files, threads and connections; may be called twice. Nothing is read afterwards."""


def missing_shard(root: str, shard: str) -> IntegrityError:
    """The error for a shard that is not there."""
    return IntegrityError(f"{shard} is missing from {root}; fetch it again")


def short_shard(root: str, span: Span, found_bytes: int) -> IntegrityError:
    """The error for a shard that ends before a stretch which the index places in it.

    Args:
        root: path or URL of the release.
        span: what was to be read.
        found_bytes: size of the shard as it was found.
    """
    return IntegrityError(
        f"{span.shard} in {root} must reach byte {span.end} to hold what the index places at byte {span.offset}, but "
        f"it ends at byte {found_bytes}; fetch it again"
    )
