"""All clips of a release in memory, a few columns of each: what is filtered and sorted while somebody types."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from wsm_data.access.release import Release
from wsm_data.curation.scores_table import Direction, ScoreTable, read_scores
from wsm_data.errors import ConfigError
from wsm_data.files.arrow_arrays import numpy_of
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.schema.arrays import Float64Array, Int64Array
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.selection import Selection
from wsm_data.view.browser.clip_query import ClipQuery
from wsm_data.view.browser.kept import Kept

RANK = "rank"
"""Place in the selection that is asked for, 1 for the hardest; a column while a selection is chosen."""

_TEXTS = ("split", "group", "physical_scene", "camera")
_NUMBERS = {"frames": "frames, padding included", "padded_frames": "still frames at the end"}
_KEPT_ORDERS = 12
_LISTED_VALUES = 300
"""A text column of more values than this is not offered as a list; its values are found by the text of the key."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TextColumn:
    """A column of few texts.

    Attributes:
        codes: number of the value of each clip; int32 [N].
        values: the texts.
    """

    codes: np.ndarray
    values: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class NumberColumn:
    """A column of numbers.

    Attributes:
        numbers: float64 [N]; NaN where a clip has none.
        unit: unit, empty where it has none.
        summary: one line: what it is.
        hard: which end is hard, as `Direction` says it; empty for what is no score.
    """

    numbers: Float64Array
    unit: str = ""
    summary: str = ""
    hard: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipTable:
    """Clips column by column, in the order of the index.

    Attributes:
        keys: keys of the clips; text [N].
        texts: text columns by name.
        numbers: number columns by name, the scores last.
    """

    keys: pa.ChunkedArray
    texts: Mapping[str, TextColumn]
    numbers: Mapping[str, NumberColumn]

    def __len__(self) -> int:
        return len(self.keys)

    def rows(self, query: ClipQuery, selection: Selection | None = None) -> Int64Array:
        """All rows that a query asks for, in its order; `offset` and `limit` are left to the caller.

        Args:
            query: what is wanted.
            selection: the selection that the query names.

        Raises:
            ConfigError: there is no such column, or value of a text column.
        """
        ranks = None if selection is None else self.ranks(selection)
        wanted = np.ones(len(self), np.bool_) if ranks is None else np.isfinite(ranks)
        for name, value in query.words.items():
            column = self.texts[_known(name, self.texts)]
            wanted &= column.codes == column.values.index(_known(value, column.values, name))
        for limits, keeps in ((query.least, np.greater_equal), (query.most, np.less_equal)):
            for name, limit in limits.items():
                wanted &= keeps(self._numbers(name, ranks), limit)  # false for NaN
        if query.text:
            found = pc.match_substring(self.keys, query.text, ignore_case=True)
            wanted &= found.to_numpy()
        order = self._order(query.sort, query.descending, ranks)
        return order[wanted[order]]

    @cached_property
    def _orders(self) -> Kept[tuple[str, bool], Int64Array]:
        return Kept(lambda asked: self._sorted_by(*asked, None), _KEPT_ORDERS)

    def ranks(self, selection: Selection) -> Float64Array:
        """Rank of each clip in a selection, NaN where it is not in it; float64 [N]."""
        places = pc.index_in(self.keys, value_set=selection.keys)
        return np.asarray(pc.cast(places, pa.float64()).to_numpy()) + 1.0  # NaN where there is none

    def records(self, rows: Sequence[int]) -> list[dict[str, Any]]:
        """Some rows as JSON values by column; a number that a clip does not have is None."""
        keys = self.keys.take(pa.array(rows, pa.int64())).to_pylist()
        return [
            {
                "key": key,
                **{name: column.values[column.codes[row]] for name, column in self.texts.items()},
                **{name: _json_number(column.numbers[row]) for name, column in self.numbers.items()},
            }
            for key, row in zip(keys, rows, strict=True)
        ]

    @cached_property
    def columns(self) -> list[dict[str, Any]]:
        """What each column is, as JSON values: the counts of its values, or its range."""
        return [
            *({"name": name, "kind": "text", "values": _counts(column)} for name, column in self.texts.items()),
            *({"name": name, "kind": "number", **_about(column)} for name, column in self.numbers.items()),
        ]

    def _numbers(self, name: str, ranks: Float64Array | None) -> Float64Array:
        if name == RANK and ranks is not None:
            return ranks
        return self.numbers[_known(name, self.numbers)].numbers

    def _order(self, name: str, descending: bool, ranks: Float64Array | None) -> Int64Array:
        """All rows, sorted; equal ones by key. Orders are kept, but those of a selection."""
        if name == "key":
            return self._by_key[::-1] if descending else self._by_key
        return self._orders.get((name, descending)) if ranks is None else self._sorted_by(name, descending, ranks)

    def _sorted_by(self, name: str, descending: bool, ranks: Float64Array | None) -> Int64Array:
        if name in self.texts:
            column = self.texts[name]
            places = np.argsort(np.argsort(np.array(column.values, object)))
            values = places[column.codes].astype(np.float64)
        else:
            known = [*self.numbers, *self.texts, "key", *([] if ranks is None else [RANK])]
            values = self._numbers(_known(name, known), ranks)
        values = values[self._by_key]
        return self._by_key[np.argsort(-values if descending else values, kind="stable")]  # NaN is last in both

    @cached_property
    def _by_key(self) -> Int64Array:
        return numpy_of(pc.sort_indices(self.keys)).astype(np.int64)


def clip_table(release: Release) -> tuple[ClipTable, str]:
    """The table of a release, and what keeps its scores out of it: empty where nothing does, or there are none.

    Raises:
        IntegrityError: the index is damaged.
    """
    index = release.index
    keys = index.columns(["key"])["key"]
    texts = {name: TextColumn(codes=codes, values=values) for name in _TEXTS for codes, values in [index.codes(name)]}
    numbers = {
        name: NumberColumn(numbers=index.numbers(name).astype(np.float64), summary=summary)
        for name, summary in _NUMBERS.items()
    }
    scores, why = _scores(release, keys)
    if scores is not None:
        numbers |= {
            one.name: NumberColumn(
                numbers=scores.columns[one.name],
                unit=one.unit,
                summary=one.summary,
                hard="" if one.direction is Direction.NEUTRAL else one.direction.value,
            )
            for one in scores.scorers
        }
    return ClipTable(keys=keys, texts=texts, numbers=numbers), why


def _scores(release: Release, keys: pa.ChunkedArray) -> tuple[ScoreTable | None, str]:
    if not release.store.exists(SCORES_NAME):
        return None, ""
    where = f"{release.store.root}/{SCORES_NAME}"
    try:
        return read_scores(where, release_digest=release.digest, release_keys=keys), ""
    except ConfigError as error:  # of another release: the clips can be looked at all the same
        return None, str(error)


def _known(name: str, known: Iterable[str], column: str = "") -> str:
    names = list(known)
    if name not in names:
        what = f"value {name!r} in the column {column}" if column else f"column {name!r}"
        raise ConfigError(f"there is no {what}; {did_you_mean(name, names)}")
    return name


def _counts(column: TextColumn) -> list[tuple[str, int]]:
    if len(column.values) > _LISTED_VALUES:
        return []
    counts = np.bincount(column.codes, minlength=len(column.values)).tolist()
    return sorted(zip(column.values, counts, strict=True))


def _about(column: NumberColumn) -> dict[str, Any]:
    there = column.numbers[np.isfinite(column.numbers)]
    return {
        "unit": column.unit,
        "summary": column.summary,
        "hard": column.hard,
        "least": float(there.min()) if len(there) else None,
        "most": float(there.max()) if len(there) else None,
    }


def _json_number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
