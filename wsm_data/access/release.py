"""A finished release, opened for reading: by path, or by the URL of any store that fsspec knows."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from wsm_data.access.clip_reader import read_members
from wsm_data.access.config import AccessConfig
from wsm_data.access.notebook import release_html
from wsm_data.access.open_shards import open_shards
from wsm_data.access.release_table import release_table
from wsm_data.access.shard_reader import ShardReader
from wsm_data.clips.decoded import DecodedVideo, decode_video
from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_bytes
from wsm_data.files.stores import LocalStore, Store, open_store
from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.codec import CodecInfo
from wsm_data.shards.clip_bytes import content_of, decode_clip
from wsm_data.shards.index.file import IndexFile, OpenFile, local_file
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.inventory import InventoryRow, parse_inventory, parse_quarantine
from wsm_data.shards.manifest import ReleaseManifest, parse_manifest
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, MANIFEST_NAME, QUARANTINE_NAME
from wsm_data.shards.release_codec import codec_of
from wsm_data.shards.selection import Selection, read_selection

if TYPE_CHECKING:
    import pandas as pd

    from wsm_data.access.clip_dataset import ClipDataset

_HASHED_AT_ONCE_BYTES = 64 << 20
_PLACES_IN_A_RUN = ("release", "pack/release")
"""Where a release lies in the folder of `wsm pack`, and in that of a run."""


@dataclass(frozen=True, eq=False, repr=False)
class Release:
    """A release whose manifest and index agree; clips are read one at a time.

    `len(release)` counts its clips, `release[key]` reads one, and iterating reads them all in the order of the index.

    Attributes:
        store: where the files are.
        manifest: dataset.json.
        index: index.parquet.
        digest: digest of the release, by which selections and loader states name it.
    """

    store: Store
    manifest: ReleaseManifest
    index: IndexTable
    digest: str

    def __repr__(self) -> str:
        splits = ", ".join(f"{count} {split}" for split, count in self.index.counts("split").items())
        facts = f"{len(self)} clips ({splits}) of {self.manifest.codec.name}"
        return f"<Release {self.manifest.name}: {facts}, {self.store.root}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: facts, and the first frame of some clips."""
        return release_html(self)

    def __len__(self) -> int:
        return len(self.index)

    def __iter__(self) -> Iterator[Clip]:
        return (self.read_row(self.index.row_at(number)) for number in range(len(self)))

    def __getitem__(self, key: str) -> Clip:
        return self.read_clip(key)

    def keys(self, *, split: str = "", selection: str = "") -> list[str]:
        """Keys of the clips of a split and of a selection, each where it is named, in the order of the index.

        Raises:
            ConfigError: there is no such split or selection.
        """
        [keys] = self.index.values(["key"], self.rows(split=split, selection=selection))
        return list(keys)

    def rows(self, *, split: str = "", selection: str | Selection = "") -> Int64Array:
        """Rows of the index of a split and of a selection, each where it is named, ascending; int64 [clips].

        Args:
            split: name of a split; empty for all.
            selection: a selection, its name in the release, or the path of its file; empty for all clips.

        Raises:
            ConfigError: there is no such split or selection, or the selection is of another release.
            IntegrityError: the selection is damaged, or lists a clip that the release does not have.
        """
        is_wanted = self._is_of_split(split)
        if not selection:
            return np.flatnonzero(is_wanted)
        rows = (self.selection(selection) if isinstance(selection, str) else selection).rows_of(self.index)
        return rows[is_wanted[rows]]

    def selection(self, name: str) -> Selection:
        """Read a selection of this release by its name in it, or by the path of its file.

        Raises:
            ConfigError: there is no such selection, or it is of another release.
            IntegrityError: it is damaged.
        """
        return read_selection(self.store, name, self.digest, self.index)

    def to_arrow(self) -> pa.Table:
        """The index, one row a clip, and behind it the scores where the release has any, by their names.

        Raises:
            ConfigError: the scores are of another release.
            IntegrityError: a table is damaged, or the scores are of other clips.
        """
        return release_table(self.store, self.index, self.digest)

    def to_pandas(self) -> "pd.DataFrame":
        """As `to_arrow`, with the key as index.

        Raises:
            ConfigError: pandas is not installed, or as `to_arrow`.
            IntegrityError: as `to_arrow`.
        """
        try:
            return self.to_arrow().to_pandas().set_index("key")
        except ModuleNotFoundError as error:
            raise ConfigError("to_pandas needs pandas: pip install pandas, or take to_arrow()") from error

    def codec(self, weights: str = "") -> VideoCodec:
        """The codec that decodes the release.

        Args:
            weights: local folder of its weights; empty for a codec without.

        Raises:
            ConfigError: the codec cannot be built, or these are not the weights of the release.
        """
        if weights not in self._codecs:
            self._codecs[weights] = codec_of(self.manifest, weights)
        return self._codecs[weights]

    def decode(self, clip: Clip | str, *, frames: Sequence[int] | None = None, weights: str = "") -> DecodedVideo:
        """Decode a clip to colour (`rgb`, uint8 [T, H, W, 3]) and metric depth (`depth_m`, float32 [T, H, W], m).

        Args:
            clip: a clip of the release, or its key.
            frames: raw frames to keep; None: all T, the still frames at the end included.
            weights: as `codec` takes it.

        Raises:
            ConfigError: there is no such clip, or it is of another codec, or the codec cannot be built.
            IndexError: the clip has no such frame.
        """
        return decode_video(self[clip] if isinstance(clip, str) else clip, self.codec(weights), frames)

    def dataset(
        self,
        *,
        split: str = "",
        selection: str = "",
        transform: Callable[[dict[str, Any]], Any] | None = None,
    ) -> "ClipDataset":
        """Some clips as a map-style torch Dataset, for a DataLoader of one's own; needs torch.

        Args:
            split: name of a split; empty for all.
            selection: name or path of a selection; empty for all clips.
            transform: makes of a sample what the dataset gives; called where samples are read. Samples of one shape
                make batches as they are; clips of different lengths need a transform, or a `collate_fn`.

        Raises:
            ConfigError: there is no such split or selection.
        """
        from wsm_data.access.clip_dataset import ClipDataset  # torch, which nothing else here needs

        return ClipDataset(self.store.root, self.keys(split=split, selection=selection), transform, release=self)

    def read_clip(self, key: str) -> Clip:
        """Read one clip with a single ranged read; its arrays are read-only views of the bytes that were read.

        Raises:
            ConfigError: the release has no such clip.
            IntegrityError: names shard, clip and member that are damaged, and were when they were read again; or the
                clip's codec is not the release's.
        """
        return self.read_row(self.index.row(key))

    def read_row(self, row: IndexRow) -> Clip:
        """Read the clip of a row of the index, as `read_clip` does.

        Raises:
            IntegrityError: as `read_clip`.
        """
        where = f"{row.shard}, clip {row.key}"
        data, members = read_members(self.shards, self._in_its_shard(row))
        clip = decode_clip(data, members, where)
        if (clip.meta.key, clip.meta.codec_digest) != (row.key, self.manifest.codec.digest):
            raise IntegrityError(
                f"{where}: the meta data must be of this clip and codec digest {self.manifest.codec.digest}, found "
                f"{clip.meta.key} and {clip.meta.codec} with {clip.meta.codec_digest}"
            )
        return clip

    def read_clip_bytes(self, key: str) -> memoryview:
        """Read a clip as it stands in its shard: tar headers, members and padding.

        Raises:
            ConfigError: the release has no such clip.
            IntegrityError: as `read_clip`.
        """
        return read_members(self.shards, self._in_its_shard(self.index.row(key)))[0]

    def read_member(self, row: IndexRow, name: str) -> memoryview:
        """Read what one member of a clip holds, an array or the meta data, without the rest of the clip.

        Raises:
            IntegrityError: as `read_clip`.
        """
        data, [member] = read_members(self.shards, self._in_its_shard(row), (name,))
        return content_of(data, member)

    def require_codec(self, codec: CodecInfo) -> None:
        """Check that latents of this release may be decoded by `codec`, or mixed with others of it.

        Raises:
            ConfigError: it is another codec, or the same with other settings or weights.
        """
        own = self.manifest.codec
        if codec.digest != own.digest:
            raise ConfigError(
                f"the release {self.manifest.name} was encoded with {own.name} (digest {own.digest}), and latents of "
                f"codecs must not be mixed; found {codec.name} (digest {codec.digest}). Use the codec of the release"
            )

    @cached_property
    def inventory(self) -> Sequence[InventoryRow]:
        """Every unit that went in, sorted by unit."""
        data = checked_file(self.store, INVENTORY_NAME, self.manifest.inventory_sha256)
        return parse_inventory(data, f"{self.store.root}/{INVENTORY_NAME}")

    @cached_property
    def quarantine(self) -> Sequence[dict[str, object]]:
        """Every refusal with reason, message and details, sorted by unit."""
        data = checked_file(self.store, QUARANTINE_NAME, self.manifest.quarantine_sha256)
        return parse_quarantine(data, f"{self.store.root}/{QUARANTINE_NAME}")

    def _in_its_shard(self, row: IndexRow) -> IndexRow:
        """The row, if its shard can hold the clip: memory for it is taken before its bytes are read."""
        end, size = row.clip_offset + row.clip_size, self.manifest.shard_bytes.get(row.shard, 0)
        if end > size:
            raise IntegrityError(
                f"{row.shard}, clip {row.key}: the index places it up to byte {end}, but by the manifest the shard has "
                f"{size} bytes; restore {INDEX_NAME} and {MANIFEST_NAME}"
            )
        return row

    @cached_property
    def _codecs(self) -> dict[str, VideoCodec]:
        return {}

    def _is_of_split(self, split: str) -> np.ndarray:
        """For each row of the index, whether it is of the split; bool [rows]."""
        if not split:
            return np.ones(len(self.index), np.bool_)
        codes, splits = self.index.codes("split")
        if split not in splits:
            raise ConfigError(
                f"{self.store.root} must have clips of split {split!r}, found {', '.join(splits) or 'none'}; "
                "set split to one of them, or to '' for all"
            )
        return codes == splits.index(split)

    @cached_property
    def shards(self) -> ShardReader:
        """What clips are read with; it opens files, or connects, when it is first used."""
        return open_shards(self.store, self.manifest, AccessConfig())


def open_release(location: str | Path) -> Release:
    """Open the release at a path or URL.

    Raises:
        ConfigError: there is no such folder, or the release lies in a folder below it.
        IntegrityError: the release is unfinished (no dataset.json), of another schema version, or its index is not the
            one the manifest vouches for.
    """
    store = open_store(location)
    data = _manifest_data(store)
    with ThreadPoolExecutor(1) as pool:  # the index of ten million clips takes seconds to hash, its manifest one more
        loading = pool.submit(_load_index, store)
        manifest = _parse_manifest(store, data)
        open_file, found = loading.result()
    _require_digest(store, INDEX_NAME, manifest.index_sha256, found)
    index = IndexTable(IndexFile(open_file, f"{store.root}/{INDEX_NAME}"))
    if len(index) != manifest.clips:
        raise IntegrityError(
            f"{store.root}: the manifest counts {manifest.clips} clips, the index has {len(index)} rows"
        )
    return Release(store, manifest, index, sha256_bytes(data))


def read_manifest(store: Store) -> ReleaseManifest:
    """Read dataset.json.

    Raises:
        ConfigError: there is no such folder, or the release lies in a folder below it.
        IntegrityError: the release is unfinished, or its manifest is not one of this schema version.
    """
    return _parse_manifest(store, _manifest_data(store))


def _manifest_data(store: Store) -> bytes:
    if not store.exists(MANIFEST_NAME):
        try:
            store.names()
        except (FileNotFoundError, NotADirectoryError) as error:
            raise ConfigError(
                f"there is no release at {store.root}; give the folder that holds {MANIFEST_NAME}"
            ) from error
        _refuse_outer_folder(store)
        raise IntegrityError(f"{store.root} has no {MANIFEST_NAME}, so the release is unfinished; run `wsm pack` again")
    return store.read(MANIFEST_NAME)


def _parse_manifest(store: Store, data: bytes) -> ReleaseManifest:
    try:
        return parse_manifest(data, f"{store.root}/{MANIFEST_NAME}")
    except IntegrityError as error:
        raise IntegrityError(f"{error}. Fetch the release again, or write it again with `wsm pack`") from error


def _load_index(store: Store) -> tuple[OpenFile, str]:
    """How to open the index, and its sha256. A local one stays on its disk, one behind a URL is fetched once."""
    if not isinstance(store, LocalStore):
        data = _read_whole(store, INDEX_NAME)
        return partial(pa.BufferReader, data), sha256_bytes(data)
    try:
        with local_file(f"{store.root}/{INDEX_NAME}") as (file, open_again):
            return open_again, _sha256(file)
    except FileNotFoundError as error:
        raise _missing(store, INDEX_NAME) from error


def _sha256(file: pa.NativeFile) -> str:
    """Digest of a file, in pieces so large that a busy interpreter in another thread does not hold it up."""
    digest, buffer = hashlib.sha256(), memoryview(bytearray(min(file.size(), _HASHED_AT_ONCE_BYTES)))
    while count := file.readinto(buffer):
        digest.update(buffer[:count])
    return digest.hexdigest()


def _refuse_outer_folder(store: Store) -> None:
    """The release of a run lies below the run's folder: say where, to those who gave that."""
    for place in _PLACES_IN_A_RUN:
        if store.exists(f"{place}/{MANIFEST_NAME}"):
            raise ConfigError(f"{store.root} is no release, but holds one: give {store.root}/{place}")


def checked_file(store: Store, name: str, sha256: str) -> bytes:
    """Read a whole file and compare its digest.

    Raises:
        IntegrityError: it is missing or was changed.
    """
    data = _read_whole(store, name)
    _require_digest(store, name, sha256, sha256_bytes(data))
    return data


def _read_whole(store: Store, name: str) -> bytes:
    try:
        return store.read(name)
    except FileNotFoundError as error:
        raise _missing(store, name) from error


def _missing(store: Store, name: str) -> IntegrityError:
    return IntegrityError(f"{store.root}/{name} is missing; fetch it again")


def _require_digest(store: Store, name: str, wanted: str, found: str) -> None:
    if found != wanted:
        raise IntegrityError(f"{store.root}/{name} must have sha256 {wanted}, found {found}; fetch it again")
