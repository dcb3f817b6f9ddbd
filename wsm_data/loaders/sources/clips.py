"""The clips that a loader draws from: releases opened, split and selection applied, and every clip with a number.

The number of a clip over all sources, its *ref*, is the base of its source plus its number in the source's table, which
has the clips in the order of the index.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wsm_data.access.release import Release, open_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_bytes
from wsm_data.loaders.config import OrderConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import EpochOrder, order_epoch
from wsm_data.loaders.order.pass_order import SourceLayout
from wsm_data.schema.arrays import Int64Array
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.members import STORED_DTYPES
from wsm_data.shards.names import INDEX_NAME, TRAIN_SPLIT


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceTable:
    """The clips of one source, in the order of the index. Columns are read when they are first asked for.

    Attributes:
        config: what was asked for.
        release: the release; its index is read column by column.
        selection: name of the selection, empty for none.
        rows: rows of the index that the source has, ascending, one more than once where a clip is to be read for
            several purposes; int64 [clips].
        base: ref of its first clip.
    """

    config: SourceConfig
    release: Release
    selection: str
    rows: Int64Array
    base: int

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def shards(self) -> tuple[str, ...]:
        """File names of the shards of the release."""
        return self._shard_column[1]

    @cached_property
    def shard_codes(self) -> np.ndarray:
        """Shard of each clip, as a number into `shards`; int32 [clips]."""
        return self._of_source(self._shard_column[0])

    @cached_property
    def layout(self) -> SourceLayout:
        """What the order of the source depends on.

        Raises:
            IntegrityError: by the index a clip has more latents than any shard has room for.
        """
        codes = self.shard_codes
        starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]])) if len(codes) else codes
        shard_clips = np.diff(np.append(starts, len(codes))).astype(np.int64)
        latents = self.column("latents")
        _require_room(self.release, int(latents.max(initial=0)))
        return SourceLayout(shard_clips=shard_clips, latents=latents, weight=self.config.weight)

    def column(self, name: str) -> np.ndarray:
        """An integer column of the index for the clips of the source, such as `rgb_latent_offset`; [clips]. Kept."""
        if name not in self._columns:
            self._columns[name] = self._of_source(self.release.index.numbers(name))
        return self._columns[name]

    def values(self, names: Sequence[str], numbers: Int64Array) -> list[np.ndarray]:
        """Some columns of the index for some clips, by their numbers in the table; texts as arrays of objects.

        Unlike `column` it holds little: what a batch needs of an index of any size.
        """
        return self.release.index.values(names, self.rows[np.asarray(numbers, np.int64)])

    def keys(self, numbers: Sequence[int] | Int64Array) -> list[str]:
        """Keys of some clips, by their numbers in the table."""
        [keys] = self.values(["key"], np.asarray(numbers, np.int64))
        return list(keys)

    def index_row(self, number: int) -> IndexRow:
        """Everything the index says of a clip, by its number in the table.

        Raises:
            IntegrityError: the row contradicts itself.
        """
        return self.release.index.row_at(int(self.rows[number]))

    @cached_property
    def _columns(self) -> dict[str, np.ndarray]:
        return {}

    @cached_property
    def _shard_column(self) -> tuple[np.ndarray, tuple[str, ...]]:
        return self.release.index.codes("shard")

    @cached_property
    def _has_all_rows(self) -> bool:
        return len(self.rows) == len(self.release.index) and bool((np.diff(self.rows) == 1).all())

    def _of_source(self, column: np.ndarray) -> np.ndarray:
        return column if self._has_all_rows else column[self.rows]


def _require_room(release: Release, latents: int) -> None:
    """Batches take their memory by the lengths that the index states, before anything is read."""
    manifest, ratio = release.manifest, release.manifest.codec.spatial_ratio
    cells = (manifest.encoded_height_px // ratio) * (manifest.encoded_width_px // ratio)
    wanted = latents * manifest.codec.channels * cells * STORED_DTYPES["rgb_latent"].itemsize
    largest = max(manifest.shard_bytes.values(), default=0)
    if wanted > largest:
        raise IntegrityError(
            f"{release.store.root}: by {INDEX_NAME} a clip has {latents} latents, which take {wanted} bytes, but the "
            f"largest shard has {largest}; restore {INDEX_NAME}"
        )


@dataclass(frozen=True, eq=False)
class Sources:
    """All sources of a loader.

    Attributes:
        tables: the sources, in the order of the settings. A clip that two of them have comes once for each.
    """

    tables: tuple[SourceTable, ...]

    def __reduce__(self) -> tuple[Any, ...]:
        """Cross to another process as settings: files stay here, and are opened again there."""
        return open_sources, ([table.config for table in self.tables],)

    @property
    def clips(self) -> int:
        """Clips of all sources; a ref is a number below it."""
        return self.tables[-1].base + len(self.tables[-1])

    @cached_property
    def layouts(self) -> tuple[SourceLayout, ...]:
        """What the order depends on."""
        return tuple(table.layout for table in self.tables)

    def order_epoch(self, order: OrderConfig, epoch: int) -> EpochOrder:
        """Order an epoch.

        Raises:
            ConfigError: a clip does not fit into a row, or the epoch has no step.
        """
        return order_epoch(self.layouts, order, epoch)

    def locate(self, ref: int) -> tuple[SourceTable, int]:
        """The source of a clip, and the number of the clip in the source's table.

        Raises:
            ValueError: there is no such ref.
        """
        if not 0 <= ref < self.clips:
            raise ValueError(f"a ref must be at least 0 and below {self.clips}, found {ref}")
        table = self.tables[bisect_right(self._bases, ref) - 1]
        return table, int(ref) - table.base

    def keys(self, refs: Sequence[int] | Int64Array) -> list[str]:
        """Keys of clips, in the order of the refs."""
        wanted = np.asarray(refs, np.int64)
        keys = np.empty(len(wanted), object)
        owners = np.searchsorted(self._bases, wanted, side="right") - 1
        for number in np.unique(owners):
            table, own = self.tables[number], owners == number
            keys[own] = table.keys(wanted[own] - table.base)
        return list(keys)

    def identity(self) -> list[dict[str, Any]]:
        """What the order is drawn over, as JSON: for each source the release by name and digest, never by its place."""
        return [_identity(table) for table in self.tables]

    @cached_property
    def _bases(self) -> list[int]:
        return [table.base for table in self.tables]


def open_sources(configs: Sequence[SourceConfig]) -> Sources:
    """Open the releases of all sources; a release of several sources is opened once.

    Raises:
        ConfigError: there is no such release, split or selection, the selection is of another release, a source has
            no clip, or the sources were made with different codecs or image sizes.
        IntegrityError: a release is unfinished or damaged.
    """
    if not configs:
        raise ConfigError("a loader must have at least one source, found none; name a release in sources")
    releases: dict[str, Release] = {}
    tables: list[SourceTable] = []
    for config in configs:
        if config.release not in releases:
            releases[config.release] = open_release(config.release)
        base = tables[-1].base + len(tables[-1]) if tables else 0
        tables.append(_open_source(config, releases[config.release], base))
        _require_alike(tables[0].release, tables[-1].release)
    return Sources(tuple(tables))


def require_depth(sources: Sources) -> None:
    """Check that every clip has depth; the index is only asked where the release's statistics do not say so.

    Raises:
        ConfigError: a clip has none; says how many, and which is the first.
    """
    for table in sources.tables:
        manifest = table.release.manifest
        all_trained = manifest.rgb_statistics.count == manifest.depth_statistics.count > 0
        if all_trained and table.config.split == TRAIN_SPLIT:
            continue
        without = np.flatnonzero(table.release.index.numbers("depth_latent_size")[table.rows] == 0)
        if len(without):
            [first] = table.keys(without[:1])
            raise ConfigError(
                f"every clip of {table.config.release} must have depth to train on it, found {len(without)} of "
                f"{len(table)} without, the first is {first}; their source has none: set depth = false, train the "
                "variant `idm`, or select clips with depth"
            )


def _open_source(config: SourceConfig, release: Release, base: int) -> SourceTable:
    chosen = release.selection(config.selection) if config.selection else None
    name = chosen.name if chosen else ""
    rows = release.rows(split=config.split, selection=chosen or "")
    if not len(rows):
        wanted = f"split {config.split or 'any'}" + (f" and selection {name}" if name else "")
        raise ConfigError(f"a source must have clips, but {config.release} has none of {wanted}")
    return SourceTable(config=config, release=release, selection=name, rows=rows, base=base)


def _require_alike(first: Release, other: Release) -> None:
    """Latents of one batch must mean the same and have the same shape."""
    first.require_codec(other.manifest.codec)
    sizes = [(release.manifest.encoded_width_px, release.manifest.encoded_height_px) for release in (first, other)]
    if sizes[0] != sizes[1]:
        raise ConfigError(
            f"the sources of a loader must have images of one size: {first.store.root} has {sizes[0]}, "
            f"{other.store.root} has {sizes[1]} (width and height, px); load them apart, or encode one again"
        )


def _identity(table: SourceTable) -> dict[str, Any]:
    return {
        "release": table.release.manifest.name,
        "release_digest": table.release.digest,
        "split": table.config.split,
        "selection": table.selection,
        "clips": len(table),
        "selection_sha256": sha256_bytes(table.rows.astype("<i8").tobytes()) if table.selection else "",
        "weight": table.config.weight,
    }
