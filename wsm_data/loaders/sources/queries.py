"""Queries of post-training: which latents of which clips a model is asked to plan from.

A query is a clip and a replan latent r: the model sees the latents 0 to r and dreams the next ones, which are compared
with the real future. A clip has as many queries in every epoch, at latents drawn anew for each, so queries are numbered
once and for all: they are a table of sources like clips, in an order of the same kind, with the same state.
"""

import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import MAX_CHUNK_LATENTS, OrderConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import EpochOrder, order_epoch
from wsm_data.loaders.order.pass_order import Int32Array
from wsm_data.loaders.order.stable_hash import Draw, mix64
from wsm_data.loaders.sources.clips import Sources, SourceTable, open_sources
from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.sequence import TEMPORAL_RATIO

_LOG = logging.getLogger(__name__)
_FIRST_REPLAN_LATENT = 1  # latent 0 is the anchor: before it is left nothing has moved


@dataclass(frozen=True, kw_only=True)
class QueryConfig:
    """Which queries a clip has.

    Attributes:
        queries_per_clip: replan latents of each clip in an epoch, no two alike; fewer where the clip is short.
        future_latents: real latents that must follow the replan latent: the K that are dreamed (paper, inference
            details).
        max_history_latents: most latents up to the replan latent and with it (the cache of the paper keeps 128).
    """

    queries_per_clip: int = 1
    future_latents: int = MAX_CHUNK_LATENTS
    max_history_latents: int = 128

    def __post_init__(self) -> None:
        if self.queries_per_clip < 1 or self.future_latents < 1:
            raise ValueError("queries_per_clip and future_latents must be at least 1")
        if self.max_history_latents <= _FIRST_REPLAN_LATENT:
            raise ValueError(f"max_history_latents must be at least 2, found {self.max_history_latents}")


@dataclass(frozen=True, eq=False)
class QuerySources(Sources):
    """Sources whose refs are queries: a clip stands in its table once for each query it has.

    Attributes:
        queries: the settings.
    """

    queries: QueryConfig

    def __reduce__(self) -> tuple[Any, ...]:
        """Cross to another process as settings."""
        return open_queries, ([table.config for table in self.tables], self.queries)

    def replan_latents(self, order: OrderConfig, epoch: int) -> Int32Array:
        """Replan latent of every query in an epoch; int32 [queries]."""
        drawn = [
            draw_replan_latents(table.rows, replan_choices(table, self.queries), order.seed, epoch, source)
            for source, table in enumerate(self.tables)
        ]
        return np.concatenate(drawn).astype(np.int32)

    def order_epoch(self, order: OrderConfig, epoch: int) -> EpochOrder:
        """Order an epoch; a sequence is what comes up to the replan latent and with it.

        Raises:
            ConfigError: the settings of the order do not go with queries, or the epoch has no step.
        """
        if order.max_latents:
            raise ConfigError(
                f"a query has all latents up to its replan latent, so max_latents must be 0, found "
                f"{order.max_latents}; set max_history_latents of the queries"
            )
        lengths = self.replan_latents(order, epoch) + 1
        parts = np.split(lengths, [table.base for table in self.tables[1:]])
        layouts = [replace(layout, latents=part) for layout, part in zip(self.layouts, parts, strict=True)]
        return order_epoch(layouts, order, epoch)

    def identity(self) -> list[dict[str, Any]]:
        """What the order is drawn over, as JSON; the settings of the queries are part of it."""
        return [source | {"queries": asdict(self.queries)} for source in super().identity()]


def open_queries(configs: Sequence[SourceConfig], queries: QueryConfig) -> QuerySources:
    """Open the releases of all sources and number the queries of their clips.

    Raises:
        ConfigError: see `open_sources`; or no clip of a source is long enough for a query.
        IntegrityError: a release is unfinished or damaged.
    """
    clips = open_sources(configs)
    tables: list[SourceTable] = []
    without = 0
    for table in clips.tables:
        counts = np.minimum(replan_choices(table, queries), queries.queries_per_clip)
        without += int((counts == 0).sum())
        if not counts.any():
            raise ConfigError(
                f"{table.release.store.root}: a query needs a clip with {queries.future_latents} real latents after "
                f"latent {_FIRST_REPLAN_LATENT}, but none of {len(table)} clips has them; lower future_latents"
            )
        base = tables[-1].base + len(tables[-1]) if tables else 0
        tables.append(replace(table, rows=np.repeat(table.rows, counts), base=base))
    if without:
        _LOG.warning("%d of %d clips are too short for a query and are left out", without, clips.clips)
    return QuerySources(tuple(tables), queries)


def replan_choices(table: SourceTable, queries: QueryConfig) -> Int64Array:
    """How many latents of each clip can be replanned from: 1, 2, ...; int64 [clips], 0 where none can.

    Real latents are those all of whose raw frames are real: still frames at the end of a clip are no future to learn.
    """
    real_frames = 1 + TEMPORAL_RATIO * (table.column("latents").astype(np.int64) - 1) - table.column("padded_frames")
    last_real = (real_frames - 1) // TEMPORAL_RATIO
    last = np.minimum(last_real - queries.future_latents, queries.max_history_latents - 1)
    return np.maximum(last - _FIRST_REPLAN_LATENT + 1, 0)


def draw_replan_latents(rows: Int64Array, choices: Int64Array, seed: int, epoch: int, source: int) -> Int64Array:
    """Replan latents of all queries of a source, without replacement among those of one clip.

    The k-th query of a clip takes one of the latents that the k before it left over, each with the same probability.

    Args:
        rows: row of the index of each query, ascending; int64 [queries].
        choices: latents its clip can be replanned from; int64 [queries].
        seed: seed of the order.
        epoch: number of the epoch.
        source: number of the source.
    """
    firsts = np.flatnonzero(np.diff(rows, prepend=-1))
    counts = np.diff(np.append(firsts, len(rows)))
    taken = np.empty((len(firsts), int(counts.max(initial=0))), np.int64)  # ascending, of the draws so far
    drawn = np.zeros(len(rows), np.int64)
    for number in range(taken.shape[1]):
        clips = np.flatnonzero(counts > number)
        left = (choices[firsts[clips]] - number).astype(np.uint64)
        own = (mix64(rows[firsts[clips]], seed, Draw.REPLAN_LATENTS, epoch, source, number) % left).astype(np.int64)
        for earlier in range(number):
            own += own >= taken[clips, earlier]
        drawn[firsts[clips] + number] = own
        taken[clips, number] = own
        taken[clips, : number + 1] = np.sort(taken[clips, : number + 1], axis=1)
    return drawn + _FIRST_REPLAN_LATENT
