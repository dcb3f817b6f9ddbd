"""Quotas: how many of the chosen clips come from one scene, group or camera, at most and at least."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean

QUOTA_COLUMNS: Mapping[str, str] = MappingProxyType({"scene": "physical_scene", "group": "group", "camera": "camera"})
"""Column of the index by which each kind of quota tells clips apart."""

_ROUNDING = 1e-9  # 0.3 of 10 clips is 3 clips, whatever 0.3 is in binary


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Bounds on a number of chosen clips. Below 1 a share of the selection, from 1 on a number: 1.0 is one clip.

    Attributes:
        at_least: no fewer than this.
        at_most: no more than this; None for no bound.
    """

    at_least: float = 0.0
    at_most: float | None = None

    def __post_init__(self) -> None:
        for name in ("at_least", "at_most"):
            value = getattr(self, name)
            if value is not None and not (0 <= value < 1 or (1 <= value < math.inf and value == int(value))):
                raise ValueError(f"{name} must be a share below 1 or a whole number of clips, found {value}")


@dataclass(frozen=True, kw_only=True)
class Quota(Limits):
    """Bounds for every value of a column, such as every camera, and others for some of them.

    Attributes:
        named: bounds of single values in place of those for every value.
    """

    named: Mapping[str, Limits] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, kw_only=True)
class QuotaConfig:
    """Quotas of a selection.

    Attributes:
        scene: for every physical scene, with all its cameras.
        group: for every data set group.
        camera: for every camera.
    """

    scene: Quota = field(default_factory=Quota)
    group: Quota = field(default_factory=Quota)
    camera: Quota = field(default_factory=Quota)


@dataclass(frozen=True, kw_only=True, eq=False)
class QuotaTable:
    """Quotas as numbers of clips. A place is one value of one kind, such as the camera zed.

    Attributes:
        names: of each place, such as `camera zed`; [P].
        codes: place of every clip in each kind of quota; int32 [kinds, N].
        least: fewest clips that must be chosen of each place; int64 [P].
        most: most clips that may be chosen of each place; int64 [P].
    """

    names: tuple[str, ...]
    codes: NDArray[np.int32]
    least: NDArray[np.int64]
    most: NDArray[np.int64]


def quota_table(config: QuotaConfig, clips: pa.Table, count: int) -> QuotaTable:
    """Work out the bounds of every place that the clips have.

    Args:
        config: the quotas.
        clips: candidates, with the columns of `QUOTA_COLUMNS`.
        count: clips that will be chosen.

    Raises:
        ConfigError: a place is named that has no candidate, or the quotas cannot be met by `count` clips or by those
            there are.
    """
    names: list[str] = []
    codes, least, most = [], [], []
    for kind, column in QUOTA_COLUMNS.items():
        quota: Quota = getattr(config, kind)
        values, numbers = column_codes(clips[column])
        _require_known(kind, quota, values)
        limits = [quota.named.get(value, quota) for value in values]
        codes.append(numbers + np.int32(len(names)))
        names += [f"{kind} {value}" for value in values]
        least += [_clips(one.at_least, count, math.ceil, -_ROUNDING) for one in limits]
        most += [count if one.at_most is None else _clips(one.at_most, count, math.floor, _ROUNDING) for one in limits]
    table = QuotaTable(
        names=tuple(names), codes=np.stack(codes), least=np.array(least, np.int64), most=np.array(most, np.int64)
    )
    _require_possible(table, count)
    return table


def column_codes(column: pa.ChunkedArray) -> tuple[list[str], NDArray[np.int32]]:
    """The values that occur in a text column, and for every row the number of its value; int32 [N]."""
    encoded = column if pa.types.is_dictionary(column.type) else column.dictionary_encode()
    encoded = encoded.unify_dictionaries().combine_chunks()
    numbers = encoded.indices.to_numpy(zero_copy_only=False)
    used = np.flatnonzero(np.bincount(numbers, minlength=len(encoded.dictionary)))
    new_number = np.zeros(len(encoded.dictionary), np.int32)
    new_number[used] = np.arange(len(used), dtype=np.int32)
    return encoded.dictionary.take(pa.array(used)).to_pylist(), new_number[numbers]


def _clips(bound: float, count: int, whole: Callable[[float], int], give: float) -> int:
    return int(bound) if bound >= 1 else whole(bound * count + give)


def _require_known(kind: str, quota: Quota, values: list[str]) -> None:
    for name in quota.named:
        if name not in values:
            raise ConfigError(
                f"quotas.{kind}.named names {name!r}, of which there is no candidate; {did_you_mean(name, values)}"
            )


def _require_possible(table: QuotaTable, count: int) -> None:
    places = range(len(table.names))
    counts = [np.bincount(codes, minlength=len(table.names)) for codes in table.codes]
    available = np.sum(counts, axis=0)
    for place in places:
        if table.least[place] > min(table.most[place], available[place]):
            raise ConfigError(
                f"the quota of {table.names[place]} cannot be met: at least {table.least[place]} clips and at most "
                f"{table.most[place]}, of {available[place]} candidates"
            )
    for kind, count_of_kind in zip(QUOTA_COLUMNS, counts, strict=True):
        of_kind = np.flatnonzero(count_of_kind)
        if table.least[of_kind].sum() > count:
            raise ConfigError(
                f"the quotas.{kind} cannot be met: they ask for at least {table.least[of_kind].sum()} clips together, "
                f"and {count} are to be chosen"
            )
        if np.minimum(table.most, available)[of_kind].sum() < count:
            raise ConfigError(
                f"the quotas.{kind} cannot be met: they allow at most "
                f"{np.minimum(table.most, available)[of_kind].sum()} clips together, and {count} are to be chosen"
            )
