"""scores.parquet: every score of every clip of one release, column by column.

One row per clip, in the order of the release's index: a text column `key`, the outline of the path and the height of
its floor, and a float64 column per score. The file's metadata holds, under `wsm.scores`, what each score is and the
digest of the release it belongs to. An absent value is null in the file and NaN in memory, and is taken only for scores
that say what their absence means.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from wsm_data.curation.path_outline import PATH_POINTS, Outlines
from wsm_data.errors import ConfigError
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.tables import opened_table, require_columns, write_table
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.schema.arrays import Float32Array, Float64Array, require_array, require_finite
from wsm_data.shards.scores_statement import read_scores_statement, with_scores_statement

KEY_COLUMN, PATH_COLUMN, FLOOR_COLUMN = "key", "path_xy_m", "floor_z_m"

_POINT_DTYPE = np.dtype("<f4")
_PATH_BYTES = PATH_POINTS * 2 * _POINT_DTYPE.itemsize
"""An outline is stored as one value of so many bytes: a list of numbers takes several times as long to read."""

_ROW_GROUP_ROWS = 1 << 17
"""What is read at a time where outlines are asked for: 34 MB of them."""
_SHOWN_CLIPS = 3


class Direction(StrEnum):
    """Which end of a score is hard."""

    HIGHER = "higher is harder"
    LOWER = "lower is harder"
    NEUTRAL = "neutral"


@dataclass(frozen=True, kw_only=True)
class ScorerInfo:
    """What a score says of itself.

    Attributes:
        name: name of its column.
        unit: unit of its values, such as `m`, `rad per 0.5 m`, `share` or `ratio`.
        direction: which end is hard.
        summary: one line: what is measured.
        version: raised when the same clip gets another value.
        absent: what a missing value means; empty where every clip has one.
    """

    name: str
    unit: str
    direction: Direction
    summary: str
    version: int = 1
    absent: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreTable:
    """Scores in memory, column by column.

    Attributes:
        release_digest: digest of the release they belong to.
        scorers: the scores, in the order of their columns.
        keys: keys of the clips, in the order of the release's index; text [N].
        columns: by the name of the score, float64 [N]; NaN where the clip has none.
    """

    release_digest: str
    scorers: tuple[ScorerInfo, ...]
    keys: pa.Array
    columns: Mapping[str, Float64Array]

    def __post_init__(self) -> None:
        names = [one.name for one in self.scorers]
        if (
            len(set(names)) != len(names)
            or {KEY_COLUMN, PATH_COLUMN, FLOOR_COLUMN} & set(names)
            or names != list(self.columns)
        ):
            raise ValueError(f"columns must be those of the scorers, once each, {names}, found {list(self.columns)}")
        for name, values in self.columns.items():
            if values.dtype != np.float64 or values.shape != (len(self.keys),):
                raise ValueError(
                    f"{name} must be float64 [{len(self.keys)}], found {values.dtype} {list(values.shape)}"
                )

    def __len__(self) -> int:
        return len(self.keys)


def write_scores(path: Path, table: ScoreTable, outlines: Outlines) -> None:
    """Write a table atomically; equal tables and an equal pyarrow give equal bytes.

    Args:
        path: where to.
        table: the scores.
        outlines: of the clips' paths (`curation.path_outline`), of 32 points.

    Raises:
        ConfigError: a value is infinite, or absent where the score says it is always there; names score and clip.
    """
    require_sound_values(table, str(path))
    arrays = [table.keys, *_stored_outlines(outlines, len(table))]
    arrays += [pa.array(values, from_pandas=True) for values in table.columns.values()]
    stored = pa.Table.from_arrays(arrays, schema=_schema(table.release_digest, table.scorers))
    write_table(
        path,
        stored,
        row_group_size=_ROW_GROUP_ROWS,
        compression={name: "zstd" if name == KEY_COLUMN else "none" for name in stored.column_names},
        use_dictionary=False,
    )


def read_scores(
    location: str | Path,
    *,
    release_digest: str,
    release_keys: pa.ChunkedArray | None = None,
    only: Sequence[str] | None = None,
) -> ScoreTable:
    """Read the scores of one release.

    Args:
        location: path or URL of the file.
        release_digest: digest of the release they must belong to.
        release_keys: the column `key` of its index. Where it is given, every clip must have its row, in this order, and
            a refusal of another release says which clips differ.
        only: names of the scores to read; None reads all.

    Raises:
        ConfigError: there is no such file, it belongs to another release, a clip has no scores, a score that is asked
            for is not there, or a value is NaN, infinite, or absent where the score is always there.
        IntegrityError: the file is damaged, or no table of scores of this version.
    """
    where = str(location)
    stored, found, scorers = _load(where, only)
    keys = stored[KEY_COLUMN]
    _require_release(where, found, release_digest, keys, release_keys)
    columns = {}
    for one in scorers:  # what was turned into an array is let go: a column of ten million clips is 80 MB
        _require_no_nan(stored[one.name], one, keys, where)
        columns[one.name] = np.asarray(stored[one.name].to_numpy(), np.float64)
        stored = stored.drop_columns([one.name])
    del stored
    keys = pa.concat_arrays(keys.chunks) if keys.num_chunks != 1 else keys.chunk(0)
    table = ScoreTable(release_digest=found, scorers=scorers, keys=keys, columns=columns)
    require_sound_values(table, where)
    return table


def stated_release(location: str | Path) -> str:
    """Digest of the release that a file of scores says it belongs to; no column is read.

    Raises:
        ConfigError: there is no such file.
        IntegrityError: it is damaged, or no table of scores of this version.
    """
    with _open(str(location)) as file:
        return _parse_metadata(file.schema_arrow)[0]


def read_scorers(location: str | Path) -> tuple[ScorerInfo, ...]:
    """What the scores of a file say of themselves, in the order of their columns; no column is read.

    Raises:
        ConfigError: there is no such file.
        IntegrityError: it is damaged, or no table of scores of this version.
    """
    with _open(str(location)) as file:
        return _parse_metadata(file.schema_arrow)[1]


def read_paths(location: str | Path, rows: NDArray[np.int64]) -> Outlines:
    """Read the outlines of some clips' paths, of 32 points, in constant memory beside what is returned.

    Args:
        location: path or URL of a file of scores.
        rows: numbers of its rows, in any order; int64 [M].

    Raises:
        ConfigError: there is no such file.
        IntegrityError: it is damaged, or no table of scores of this version.
    """
    xy_m, floor_z_m = np.empty((len(rows), PATH_POINTS, 2), np.float32), np.empty(len(rows), np.float32)
    first = 0
    with _open(str(location)) as file:
        _parse_metadata(file.schema_arrow)
        for group in range(file.num_row_groups):
            count = file.metadata.row_group(group).num_rows
            inside = np.flatnonzero((rows >= first) & (rows < first + count))
            if len(inside):
                stored = file.read_row_group(group, [PATH_COLUMN, FLOOR_COLUMN])
                if stored[PATH_COLUMN].null_count or stored[FLOOR_COLUMN].null_count:
                    raise ValueError("every clip must have an outline and a floor")
                xy_m[inside] = _points(stored[PATH_COLUMN])[rows[inside] - first]
                floor_z_m[inside] = stored[FLOOR_COLUMN].to_numpy()[rows[inside] - first]
            first += count
    return Outlines(xy_m=xy_m, floor_z_m=floor_z_m)


def require_sound_values(table: ScoreTable, where: str) -> None:
    """Check that no value is infinite, and none is absent but where its score allows that.

    Raises:
        ConfigError: names score and clip.
    """
    for one in table.scorers:
        values = table.columns[one.name]
        bad = np.isinf(values) if one.absent else ~np.isfinite(values)
        if bad.any():
            place = int(bad.argmax())
            found = "no value" if np.isnan(values[place]) else str(values[place])
            raise ConfigError(
                f"{where}: the score {one.name} of clip {table.keys[place].as_py()} must be a number, found {found}; "
                f"{int(bad.sum())} clips are like this. Run `wsm score` again"
            )


def _schema(release_digest: str, scorers: Sequence[ScorerInfo]) -> pa.Schema:
    columns = [(KEY_COLUMN, pa.string()), (PATH_COLUMN, pa.binary(_PATH_BYTES)), (FLOOR_COLUMN, pa.float32())]
    columns += [(one.name, pa.float64()) for one in scorers]
    return with_scores_statement(pa.schema(columns), release_digest, to_json(scorers))


def _stored_outlines(outlines: Outlines, clips: int) -> list[pa.Array]:
    """The columns of paths and floors, none of whose numbers may be missing."""
    require_array("xy_m", outlines.xy_m, np.float32, (clips, PATH_POINTS, 2))
    require_finite("xy_m", outlines.xy_m)
    require_finite("floor_z_m", outlines.floor_z_m)
    points = pa.py_buffer(np.ascontiguousarray(outlines.xy_m, _POINT_DTYPE))
    paths = pa.FixedSizeBinaryArray.from_buffers(pa.binary(_PATH_BYTES), clips, [None, points])
    return [paths, pa.array(outlines.floor_z_m)]


def _points(stored: pa.ChunkedArray) -> Float32Array:
    """The points of stored outlines; float32 [N, 32, 2]."""
    array = stored.combine_chunks()
    data = np.frombuffer(array.buffers()[1], _POINT_DTYPE, len(array) * PATH_POINTS * 2, array.offset * _PATH_BYTES)
    return data.reshape(len(array), PATH_POINTS, 2).astype(np.float32, copy=False)


def _load(where: str, only: Sequence[str] | None) -> tuple[pa.Table, str, tuple[ScorerInfo, ...]]:
    """The stored columns, the digest of their release, and the scores that were asked for."""
    with _open(where) as file:
        release_digest, scorers = _parse_metadata(file.schema_arrow)
        chosen = _chosen(scorers, only, where)
        return file.read([KEY_COLUMN, *(one.name for one in chosen)]), release_digest, chosen


@contextmanager
def _open(where: str) -> Iterator[pq.ParquetFile]:
    must_be = f"{where} must be a table of scores"
    try:
        with opened_table(partial(fsspec.open, where, "rb"), must_be, "run `wsm score` again") as file:
            yield file
    except FileNotFoundError as error:
        raise ConfigError(f"there are no scores at {where}; run `wsm score RELEASE` first") from error


def _parse_metadata(schema: pa.Schema) -> tuple[str, tuple[ScorerInfo, ...]]:
    statement = read_scores_statement(schema)
    scorers = tuple(from_json(ScorerInfo, one) for one in statement["scorers"])
    require_columns(schema, _schema(statement["release_digest"], scorers))
    return str(statement["release_digest"]), scorers


def _chosen(scorers: Sequence[ScorerInfo], only: Sequence[str] | None, where: str) -> tuple[ScorerInfo, ...]:
    by_name = {one.name: one for one in scorers}
    for name in only or ():
        if name not in by_name:
            raise ConfigError(f"{where} has no score {name!r}; {did_you_mean(name, by_name)}")
    return tuple(one for one in scorers if only is None or one.name in only)


def _require_release(
    where: str, found: str, wanted: str, keys: pa.ChunkedArray, release_keys: pa.ChunkedArray | None
) -> None:
    same_clips = release_keys is None or keys.equals(release_keys.cast(pa.string()))
    if found == wanted and same_clips:
        return
    what = "another release" if found != wanted else "these clips"
    lines = [
        f"{where} must hold the scores of this release, and it is of {what}:",
        f"  release digest: {found} -> {wanted}",
    ]
    if release_keys is not None:
        lines += key_differences(keys, release_keys)
    raise ConfigError("\n".join([*lines, "Run `wsm score` on this release"]))


def key_differences(old: pa.ChunkedArray, new: pa.ChunkedArray) -> list[str]:
    """Lines that say which clips two lists of keys do not share, and whether their order differs."""
    lines = [f"  clips: {len(old)} -> {len(new)}"]
    for text, here, there in (("gone", old, new), ("added", new, old)):
        other = here.filter(pc.invert(pc.is_in(here, value_set=there)))
        if len(other):
            shown = ", ".join(other.slice(0, _SHOWN_CLIPS).to_pylist())
            lines.append(f"  {text}: {len(other)}, such as {shown}")
    return lines if len(lines) > 1 or len(old) != len(new) else [*lines, "  the clips are the same"]


def _require_no_nan(values: pa.ChunkedArray, one: ScorerInfo, keys: pa.ChunkedArray, where: str) -> None:
    """NaN is no way to store that a value is absent: whoever wrote it computed something wrong."""
    nan = pc.fill_null(pc.is_nan(values), False)
    if pc.any(nan).as_py():
        place = pc.index(nan, True).as_py()
        raise ConfigError(
            f"{where}: the score {one.name} of clip {keys[place].as_py()} must be a number, found NaN; "
            f"{pc.sum(nan).as_py()} clips are like this. Run `wsm score` again, or correct what wrote the file"
        )
