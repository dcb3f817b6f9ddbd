"""Fragments put one after the other: a shard."""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import xxhash

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.shards.fragment import FragmentInfo, read_fragment_info
from wsm_data.shards.manifest import ShardInfo, withdraw_manifest
from wsm_data.shards.shard_layout import PlacedClip, ShardLayout
from wsm_data.shards.tar_format import END_OF_ARCHIVE

_COPY_BYTES = 4 << 20


def write_shard(path: Path, layout: ShardLayout, path_of: Callable[[str], Path]) -> ShardInfo:
    """Write the shard of a layout at `path`, atomically, in constant memory.

    Every fragment is compared with the size and digest in its sidecar while it is copied, so that what was damaged
    since it was encoded does not get into a release.

    Args:
        path: where the shard goes; its name must be that of the layout.
        layout: the clips and their order.
        path_of: path of a fragment by the key of its clip.

    Raises:
        IntegrityError: names the clip whose fragment is missing or disagrees with its sidecar or with the layout.
        ValueError: the file name is not the layout's.
    """
    return write_blocks(path, layout, lambda clip: _checked_blocks(path_of(clip.key), clip))


def write_blocks(
    path: Path, layout: ShardLayout, blocks_of: Callable[[PlacedClip], Iterable[bytes | memoryview]]
) -> ShardInfo:
    """Write the shard of a layout at `path`, atomically, from the bytes of its clips; the release is unfinished then.

    Args:
        path: where the shard goes; its name must be that of the layout.
        layout: the clips and their order.
        blocks_of: bytes of a clip: tar headers, members and padding; as many as the layout says.

    Raises:
        IntegrityError: the bytes of a clip are more or fewer than the layout says.
        ValueError: the file name is not the layout's.
    """
    if path.name != layout.name:
        raise ValueError(f"the shard {layout.name} must be written under its own name, found {path.name}")
    withdraw_manifest(path.parent)
    digest = hashlib.sha256()
    size = 0
    with atomic_file(path) as file:
        for clip in layout.clips:
            before = size
            for block in blocks_of(clip):
                file.write(block)
                digest.update(block)
                size += len(block)
            if size - before != clip.size_bytes:
                raise IntegrityError(f"clip {clip.key} must have {clip.size_bytes} bytes, found {size - before}")
        file.write(END_OF_ARCHIVE)
        digest.update(END_OF_ARCHIVE)
    return ShardInfo(
        name=layout.name,
        split=layout.split,
        clips=len(layout.clips),
        bytes=size + len(END_OF_ARCHIVE),
        sha256=digest.hexdigest(),
    )


def _checked_blocks(path: Path, clip: PlacedClip) -> Iterator[bytes]:
    info = read_fragment_info(path)
    _require_as_laid_out(path, info, clip)
    digest = xxhash.xxh3_128()
    size = 0
    try:
        with path.open("rb") as file:
            while block := file.read(_COPY_BYTES):
                digest.update(block)
                size += len(block)
                yield block
    except FileNotFoundError as error:
        raise IntegrityError(f"clip {clip.key}: its fragment {path} is missing; encode it again") from error
    if (size, digest.hexdigest()) != (info.size_bytes, info.digest):
        raise IntegrityError(
            f"clip {clip.key}: its fragment {path} must have {info.size_bytes} bytes and digest {info.digest}, found "
            f"{size} bytes and {digest.hexdigest()}; encode it again"
        )


def _require_as_laid_out(path: Path, info: FragmentInfo, clip: PlacedClip) -> None:
    if (info.key, info.size_bytes) != (clip.key, clip.size_bytes):
        raise IntegrityError(
            f"clip {clip.key}: the layout expects a fragment of {clip.size_bytes} bytes, but {path} holds {info.key} "
            f"with {info.size_bytes} bytes; it was encoded again since; run `wsm pack` again"
        )
