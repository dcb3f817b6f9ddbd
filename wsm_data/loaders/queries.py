"""The loader of post-training: queries in the order of the epoch, each with its history, its map and its goal."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
import torch
import torch.utils.data

from wsm_data.access.clip_reader import read_members, span_of_members
from wsm_data.access.shard_reader import ShardReader
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.batches.query_batch import QueryBatch
from wsm_data.loaders.config import LoaderConfig, ReadConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.order.epoch_order import EpochSummary
from wsm_data.loaders.reading.verification import verification_of
from wsm_data.loaders.sources.queries import QueryConfig, QuerySources, open_queries
from wsm_data.schema.clip import UNREACHABLE_MM
from wsm_data.schema.clip_meta import ClipMeta, parse_meta
from wsm_data.schema.occupancy import UNKNOWN
from wsm_data.schema.sequence import TEMPORAL_RATIO, frames_of
from wsm_data.shards.clip_bytes import content_of
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.members import META, STORED_DTYPES

_MAP_MEMBERS = ("occupancy", "geodesic_mm", "expert_distance", META)
"""Members that a query needs beside those of a batch, in stored order."""


class QueryLoader(torch.utils.data.IterableDataset[QueryBatch]):
    """Batches of queries of one rank: order, state, ledger and workers are those of `ClipLoader`."""

    def __init__(
        self,
        config: LoaderConfig,
        queries: QueryConfig | None = None,
        *,
        rank: int | None = None,
        world_size: int | None = None,
    ):
        """Open the sources; no clip is read yet.

        Args:
            config: what is read, in which order, and how; `chunk_sizes` and `weight` are those of queries.
            queries: which queries a clip has; None: the defaults.
            rank: number of this rank; None: that of torch.distributed, 0 where it is not initialised.
            world_size: number of ranks; None: that of torch.distributed, 1 where it is not initialised.

        Raises:
            ConfigError: the settings contradict themselves, the sources, or this machine.
            IntegrityError: a release is unfinished or damaged.
            ValueError: there is no such rank.
        """
        self._config, self._place = config, (rank, world_size)
        self._sources = open_queries(config.sources, queries or QueryConfig())
        self._histories = ClipLoader(config, rank=rank, world_size=world_size, sources=self._sources)
        self._maps = _MapReader(self._sources, config.read)

    def __reduce__(self) -> tuple[Any, ...]:
        """Cross to another process as settings and a place."""
        return _reopened, (self._config, self._sources.queries, *self._place, self.state_dict())

    @property
    def sources(self) -> QuerySources:
        """The queries, by their refs."""
        return self._sources

    @property
    def steps(self) -> int:
        """Global steps of the current epoch, the same on every rank."""
        return self._histories.steps

    @property
    def summary(self) -> EpochSummary:
        """What becomes of the queries in the current epoch; `clips` counts queries."""
        return self._histories.summary

    def state_dict(self) -> dict[str, Any]:
        """The place behind the last batch that was delivered, as JSON."""
        return self._histories.state_dict()

    def load_state_dict(self, state_dict: Mapping[str, Any]) -> None:
        """Go on from a place, on as many ranks or threads as there are now.

        Raises:
            ConfigError: the state is of other sources, other queries, or another order.
        """
        self._histories.load_state_dict(state_dict)

    def set_epoch(self, epoch: int) -> None:
        """Go to the start of an epoch; nothing where the loader is in it already."""
        self._histories.set_epoch(epoch)

    def __iter__(self) -> Iterator[QueryBatch]:
        return self._histories.completed(self._maps.with_maps, lambda batch: batch.history)

    def close(self) -> None:
        """End all threads, close the files and the ledger. A later iterator opens them again."""
        self._histories.close()

    def __enter__(self) -> "QueryLoader":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _reopened(
    config: LoaderConfig,
    queries: QueryConfig,
    rank: int | None,
    world_size: int | None,
    state: Mapping[str, Any],
) -> QueryLoader:
    loader = QueryLoader(config, queries, rank=rank, world_size=world_size)
    loader.load_state_dict(state)
    return loader


@dataclass(frozen=True, kw_only=True, eq=False)
class _ClipMap:
    meta: ClipMeta
    occupancy: np.ndarray
    geodesic_mm: np.ndarray
    expert_distance: np.ndarray


class _MapReader:
    """Reads what stands behind the members of a batch: map, field, distances, meta data. Safe for several threads."""

    def __init__(self, sources: QuerySources, read: ReadConfig):
        self._sources = sources
        self._verification = verification_of(sources.tables, read)

    def with_maps(self, history: Batch, readers: Sequence[ShardReader]) -> QueryBatch:
        """Put the maps to the histories of a step.

        Args:
            history: the histories.
            readers: of the shards of each source.

        Raises:
            ConfigError: a clip has no map but the strip that its expert swept.
            IntegrityError: the bytes of a clip are not those that the release vouches for; names shard and clip.
        """
        maps = self._clip_maps(history.refs.tolist(), readers)
        replan = np.array([span.length for span in history.spans], np.int64) - 1
        T_world_camera0 = np.array([one.meta.T_world_camera0_matrix for one in maps]).reshape(-1, 4, 4)
        resolution_m = np.array([one.meta.map_resolution_m for one in maps])
        origin_cell = np.array([one.meta.map_origin_cell for one in maps], np.int64).reshape(-1, 2)
        shapes = np.array([one.occupancy.shape for one in maps], np.int64).reshape(-1, 2)
        arrays = {
            "replan_latent": replan,
            "occupancy": _stacked([one.occupancy for one in maps], shapes, UNKNOWN, np.uint8),
            "geodesic_mm": _stacked([one.geodesic_mm for one in maps], shapes, UNREACHABLE_MM, np.uint16),
            "map_shape": shapes,
            "map_origin_m": origin_cell * resolution_m[:, None],
            "resolution_m": resolution_m,
            "T_world_camera0": T_world_camera0,
            "T_world_camera": T_world_camera0 @ transforms_from_vectors(_last_poses(history)),
            "goal_world_m": np.array([one.meta.goal_world_m for one in maps], np.float64).reshape(-1, 3),
            "goal_radius_m": np.array([one.meta.goal_radius_m for one in maps], np.float64),
            "robot_radius_m": np.array([one.meta.robot_radius_m for one in maps], np.float64),
            "expert_distance_m": self._future(maps, replan),
        }
        return QueryBatch(history=history, **{name: torch.from_numpy(array) for name, array in arrays.items()})

    def _future(self, maps: Sequence[_ClipMap], replan: np.ndarray) -> np.ndarray:
        frames = frames_of(1 + self._sources.queries.future_latents)
        future = np.empty((len(maps), frames), np.float32)
        for number, (one, latent) in enumerate(zip(maps, replan.tolist(), strict=True)):
            future[number] = one.expert_distance[TEMPORAL_RATIO * latent :][:frames]
        return future

    def _clip_maps(self, refs: Sequence[int], readers: Sequence[ShardReader]) -> list[_ClipMap]:
        places = [self._sources.locate(ref) for ref in refs]
        owners = [self._sources.tables.index(table) for table, _ in places]
        rows = [table.index_row(number) for table, number in places]
        for owner, row in zip(owners, rows, strict=True):  # a slow store is asked for all of them at once
            readers[owner].expect([span_of_members(row, _MAP_MEMBERS)])
        return [
            self._clip_map(readers[owner], row, owner, number)
            for owner, row, (_, number) in zip(owners, rows, places, strict=True)
        ]

    def _clip_map(self, reader: ShardReader, row: IndexRow, source: int, number: int) -> _ClipMap:
        due = self._verification.is_due(source, number)
        data, members = read_members(reader, row, _MAP_MEMBERS, checked=due)
        self._verification.passed(source, number)
        arrays = {
            member.name: np.frombuffer(content_of(data, member), STORED_DTYPES[member.name]).reshape(member.shape)
            for member in members[:-1]
        }
        meta = _meta(content_of(data, members[-1]), row)
        if meta.map_from == "path":  # all but the expert's own strip is unknown, so every other way would be unsafe
            raise ConfigError(
                f"{row.shard}, clip {row.key}: the clip of a query must have a map, but its source had neither a "
                "cloud nor depth to make one of; select clips whose map_from is cloud or depth"
            )
        return _ClipMap(meta=meta, **arrays)


def _meta(content: memoryview, row: IndexRow) -> ClipMeta:
    try:
        return parse_meta(content)
    except ValueError as error:
        raise IntegrityError(f"{row.shard}, clip {row.key}: meta.json must be that of a clip, but: {error}") from error


def _last_poses(history: Batch) -> np.ndarray:
    """Pose of the last raw frame of each history in its first camera's frame; float32 [N, 7]."""
    poses = history.poses.cpu().numpy()
    rows, last = ([span.row for span in history.spans], [span.end - 1 for span in history.spans])
    return np.asarray(poses[rows, last, -1])


def _stacked(arrays: Sequence[np.ndarray], shapes: np.ndarray, padding: int, dtype: type[np.generic]) -> np.ndarray:
    """Arrays [Y, X] of different sizes in one [N, Y, X]."""
    stacked = np.full((len(arrays), *shapes.max(axis=0, initial=0).tolist()), padding, dtype)
    for number, array in enumerate(arrays):
        stacked[number, : array.shape[0], : array.shape[1]] = array
    return stacked
