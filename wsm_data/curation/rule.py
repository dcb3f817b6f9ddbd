"""How hard a clip is: scores put into one number by weighted ranks, or one after the other.

Scores have different units and tails, so they are compared by rank: the percentile of a clip is the share of clips that
are easier, clips of equal value counted half (mid-ranks). Any monotone change of a score's unit leaves it as it is.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

import numba
import numpy as np
from numpy.typing import NDArray

from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.schema.arrays import Float32Array, Float64Array

GEOMETRY_WEIGHTS: Mapping[str, float] = MappingProxyType(
    {
        "passage_narrowest_m": 4.0,
        "dead_end_retreat_m": 2.0,
        "detour_ratio": 1.0,
        "turning_total_rad": 1.0,
        "clearance_tight_share": 1.0,
        "goal_behind_walls_share": 0.5,
    }
)
"""The default rule, which needs no model. A narrow door is felt by one score alone, a detour by five, so the weights
differ. They were chosen among round numbers on homes with planted difficulties (bench/curation_validity.py), and are
reported there on others."""

MODEL_ORDER = ("rollout_unsafe_share", "rollout_mean_cost_m2")
"""Recommended for `lexicographic` once a policy was rolled out: how often it is unsafe, and then what it costs."""

EMPHASES = (1, 2, 4, 8, 16, 32, 64)
"""Powers of two: such powers and roots are products and square roots, whose last bit is the same on every processor,
which that of `pow` is not. With the largest one the mean is nearly the largest percentile."""


_SORTS_AT_ONCE = 2  # each takes some 500 MB for ten million clips


class RuleKind(StrEnum):
    """How scores become one number."""

    WEIGHTED = "weighted"
    LEXICOGRAPHIC = "lexicographic"


@dataclass(frozen=True, kw_only=True)
class RuleConfig:
    """What hard means.

    Attributes:
        kind: `weighted`: a weighted mean of the percentiles of `weights`. `lexicographic`: by the first score of
            `order`, clips that are equal in it by the second one, and so on.
        weights: weight of each score, above 0; only for `weighted`. Given weights replace the default ones.
        emphasis: exponent k of the mean (sum w p^k / sum w)^(1/k); only for `weighted`. 1 is the plain mean. The larger
            it is, the more a clip is as hard as its hardest score, however easy it is by the others: a narrow door is
            hard on a short and straight way too.
        order: scores by importance; only for `lexicographic`.
    """

    kind: RuleKind = RuleKind.WEIGHTED
    weights: Mapping[str, float] = field(default_factory=lambda: GEOMETRY_WEIGHTS)
    emphasis: int = 4
    order: tuple[str, ...] = MODEL_ORDER

    def __post_init__(self) -> None:
        if self.emphasis not in EMPHASES:
            raise ValueError(f"emphasis must be one of {', '.join(map(str, EMPHASES))}, found {self.emphasis}")
        for name, weight in self.weights.items():
            if not (0 < weight < np.inf):
                raise ValueError(
                    f"weights.{name} must be a number above 0, found {weight}; leave the score out instead"
                )
        if not self.scores:
            raise ValueError("a rule needs at least one score")
        if len(set(self.scores)) != len(self.scores):
            raise ValueError(f"order must name a score once, found {list(self.order)}")

    @property
    def scores(self) -> tuple[str, ...]:
        """Names of the scores that the rule reads."""
        return tuple(self.weights) if self.kind is RuleKind.WEIGHTED else self.order

    @property
    def score_weights(self) -> Mapping[str, float]:
        """Weight of each score that the rule reads; equal ones where it goes by their order."""
        return self.weights if self.kind is RuleKind.WEIGHTED else dict.fromkeys(self.order, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Rating:
    """How hard clips are under a rule.

    Attributes:
        difficulty: larger is harder, in [0, 1]; float64 [M].
        percentiles: share of clips that are easier, by the name of the score; float32 [M]; NaN where a clip has none.
    """

    difficulty: Float64Array
    percentiles: Mapping[str, Float32Array]


def rate_clips(scores: ScoreTable, config: RuleConfig, rows: NDArray[np.int64] | None = None) -> Rating:
    """Rate clips against one another.

    A clip without a value of a score is rated by its others under `weighted`, and as the easiest one by that score
    under `lexicographic`: it was not shown to be hard.

    Args:
        scores: the scores of a release.
        config: the rule.
        rows: which clips, int64 [M]; None for all.

    Raises:
        ConfigError: the rule names a score that is not there or has no hard end, or a clip has none of its scores.
    """
    infos = ruling_scores(scores.scorers, config)
    clips = len(scores.keys) if rows is None else len(rows)
    mean = _PowerMean(clips, config.emphasis) if config.kind is RuleKind.WEIGHTED else None
    percentiles: dict[str, Float32Array] = {}
    ranked: list[Float64Array] = []
    with ThreadPoolExecutor(_SORTS_AT_ONCE) as pool:  # sorting holds no lock, and takes most of the time
        found = pool.map(lambda one: hardness_percentiles(_column(scores, one.name, rows), one.direction), infos)
        for name, one in zip(config.scores, found, strict=True):
            percentiles[name] = one.astype(np.float32)
            if mean is None:
                ranked.append(one)
            else:  # and it is let go: ten million numbers are 80 MB
                mean.add(one, config.weights[name])
    difficulty = _lexicographic(ranked) if mean is None else mean.result()
    unrated = np.isnan(difficulty)
    if unrated.any():
        place = int(unrated.argmax())
        key = scores.keys[place if rows is None else int(rows[place])].as_py()
        raise ConfigError(
            f"{int(unrated.sum())} clips have none of the scores of the rule ({', '.join(config.scores)}), such as "
            f"{key}; score them, select by other scores, or leave them out with exclude.unscored=true"
        )
    return Rating(difficulty=difficulty, percentiles=percentiles)


def ruling_scores(scorers: Sequence[ScorerInfo], config: RuleConfig) -> tuple[ScorerInfo, ...]:
    """The scores that a rule reads, in its order, of those there are.

    Raises:
        ConfigError: the rule names a score that is not there or has no hard end.
    """
    infos = {one.name: one for one in scorers}
    for name in config.scores:
        if name not in infos:
            hint = " (from rollouts: evaluate a policy first)" if name.startswith("rollout_") else ""
            raise ConfigError(
                f"the rule needs the score {name!r}{hint}, which is not there; {did_you_mean(name, infos)}"
            )
        if infos[name].direction is Direction.NEUTRAL:
            raise ConfigError(f"the score {name!r} has no hard end, so a rule cannot go by it; take another")
    return tuple(infos[name] for name in config.scores)


def hardness_percentiles(values: Float64Array, direction: Direction) -> Float64Array:
    """Share of values that are easier than each, equal ones counted half; NaN, where there is no value, stays NaN.

    Returns:
        float64 [M], strictly between 0 and 1.
    """
    order = np.argsort(values)
    known = len(values) - int(np.isnan(values).sum())  # numpy sorts NaN to the end
    result = np.full(len(values), np.nan)
    _fill_mid_ranks(values, order, known, direction is Direction.LOWER, result)
    return result


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_mid_ranks(
    values: Float64Array, order: NDArray[np.int64], known: int, lower_is_harder: bool, result: Float64Array
) -> None:
    """Write the share of each run of equal values, in their order, without a copy of them."""
    start = 0
    while start < known:
        value, end = values[order[start]], start + 1
        while end < known and values[order[end]] == value:
            end += 1
        share = (start + (end - start) / 2) / known
        for place in range(start, end):
            result[order[place]] = 1 - share if lower_is_harder else share
        start = end


def _column(scores: ScoreTable, name: str, rows: NDArray[np.int64] | None) -> Float64Array:
    values = scores.columns[name]
    return values if rows is None else values[rows]


class _PowerMean:
    """Power mean over the scores a clip has, one score after the other; NaN where it has none."""

    def __init__(self, clips: int, emphasis: int):
        self._emphasis = emphasis
        self._total, self._weight = np.zeros(clips), np.zeros(clips)

    def add(self, percentiles: Float64Array, weight: float) -> None:
        """Count one score."""
        _add_powers(percentiles, self._emphasis.bit_length() - 1, weight, self._total, self._weight)

    def result(self) -> Float64Array:
        """The mean of what was counted, float64 [clips]."""
        known = self._weight > 0
        mean = np.divide(self._total, self._weight, out=np.full(len(known), np.nan), where=known)
        for _ in range(self._emphasis.bit_length() - 1):
            np.sqrt(mean, out=mean)
        return mean


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _add_powers(
    values: Float64Array, squarings: int, weight: float, total: Float64Array, weight_of_all: Float64Array
) -> None:
    """Add the powers of what is known, times the weight, in one pass."""
    for clip in range(len(values)):
        term = values[clip]
        if not np.isnan(term):
            for _ in range(squarings):
                term *= term
            total[clip] += term * weight
            weight_of_all[clip] += weight


def power(values: Float64Array, exponent: int) -> Float64Array:
    """Values to the power of an exponent of `EMPHASES`, by squaring."""
    for _ in range(exponent.bit_length() - 1):
        values = values * values
    return values


def _lexicographic(percentiles: Sequence[Float64Array]) -> Float64Array:
    """Mid-rank in the order by the first score, then the second, ...; NaN where a clip has none of them."""
    codes = [np.nan_to_num(values, nan=-1.0) for values in percentiles]
    order = np.lexsort(codes[::-1])
    changes = np.zeros(len(order), bool)
    for one in codes:
        changes[1:] |= one[order][1:] != one[order][:-1]
    group = np.empty(len(order))
    group[order] = np.cumsum(changes)
    difficulty = hardness_percentiles(group, Direction.HIGHER)
    difficulty[np.all([np.isnan(values) for values in percentiles], axis=0)] = np.nan
    return difficulty
