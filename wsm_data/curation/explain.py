"""Why a clip is hard, as text: `detour 2.8 (99th percentile); turning 9.4 rad (97th percentile)`.

A million clips share few texts: values are written with three digits, so each text is made once and then looked up.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from wsm_data.curation.rule import power
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.schema.arrays import Float32Array, Float64Array

_REASONS = 3
_NOTABLE = 0.5
"""A score by which a clip is easier than half of all is no reason, unless it has no better one."""

_DIGITS = 3
_LEAST_POWER, _MOST_POWER = -300, 308
_POWERS_OF_TEN = np.array([float(f"1e{power}") for power in range(_LEAST_POWER, _MOST_POWER + 1)])
"""As they are written, to the last bit: `pow` differs there from processor to processor, and a text with it."""

_ROUNDING = 1e-4  # a percentile is float32: 0.9 of 100 is 90
_NO_UNIT = ("", "ratio")
_UNIT_SUFFIX = re.compile(r"_(m|rad|share|ratio|rad_per_frame)$")


@dataclass(frozen=True, kw_only=True, eq=False)
class ExplainedScore:
    """What one score says of the clips that are explained.

    Attributes:
        info: the score.
        weight: its weight in the rule.
        emphasis: exponent of its percentile in the rule.
        values: float64 [n]; NaN where a clip has none.
        percentiles: share of clips that are easier; float32 [n]; NaN likewise.
    """

    info: ScorerInfo
    weight: float
    emphasis: int
    values: Float64Array
    percentiles: Float32Array


def explain_clips(scores: Sequence[ExplainedScore], *, in_order: bool = False) -> pa.StringArray:
    """Name for every clip the scores that made it hard, at most three; empty where it has none of them.

    The percentile of a value is the share of clips whose value is smaller: of a score whose low end is hard, the 2nd is
    hard.

    Args:
        scores: the scores of the rule, at least one.
        in_order: name them in the order in which they are given, as a lexicographic rule goes by them; otherwise by
            their weighted share of the clip's difficulty.
    """
    texts: list[str] = []
    codes = np.empty((len(scores[0].values), len(scores)), np.int64)
    for number, one in enumerate(scores):
        own, codes[:, number] = _texts(one)
        codes[:, number] += len(texts)
        texts += own
    table = pa.array(texts, pa.string())
    order = _ranked(scores, in_order)
    columns = [table.take(pa.array(codes[np.arange(len(codes)), slot], mask=slot < 0)) for slot in order.T]
    return pc.binary_join_element_wise(*columns, "; ", null_handling="skip")


def leading_scores(scores: Sequence[ExplainedScore]) -> NDArray[np.int64]:
    """Number of the score with the largest weighted share of each clip's difficulty; int64 [n]."""
    return np.asarray(_shares(scores).argmax(axis=1))


def deciding_scores(scores: Sequence[ExplainedScore], left_out: int | None) -> NDArray[np.int64]:
    """Number of the score by which a lexicographic rule put each clip before the first one that was left out.

    Args:
        scores: the scores of the rule, in its order.
        left_out: number of that clip among those that are explained; None where none was left out.

    Returns:
        int64 [n]: the first score a clip has whose value is not that of `left_out`, or the first that it has where
        there is no such one.
    """
    values = np.stack([one.values for one in scores], axis=1)
    known = ~np.isnan(values)
    told = known & (values != values[left_out]) if left_out is not None else known
    return np.asarray(np.where(told.any(axis=1, keepdims=True), told, known).argmax(axis=1))


def value_text(value: float, unit: str) -> str:
    """A value with its unit; a share in per cent."""
    if unit == "share":
        return f"{100 * value:.{_DIGITS}g} %"
    number = f"{value:,.0f}" if abs(value) >= 10**_DIGITS else f"{value:.{_DIGITS}g}"
    return number + ("" if unit in _NO_UNIT else f" {unit}")


def score_label(info: ScorerInfo) -> str:
    """Name of a score in words, without the unit that follows the number."""
    return _UNIT_SUFFIX.sub("", info.name).replace("_", " ")


def _shares(scores: Sequence[ExplainedScore]) -> Float64Array:
    """What each score adds to the difficulty, float64 [n, scores]; below all others where a clip has no value."""
    return np.stack(
        [
            np.nan_to_num(power(one.percentiles.astype(np.float64), one.emphasis) * one.weight, nan=-1.0)
            for one in scores
        ],
        axis=1,
    )


def _ranked(scores: Sequence[ExplainedScore], in_order: bool) -> NDArray[np.int64]:
    """Numbers of the scores to name, int64 [n, slots]; -1 where there is none."""
    percentiles = np.stack([one.percentiles for one in scores], axis=1)
    shares = _shares(scores)
    order = np.argsort(-shares, axis=1, kind="stable")
    if in_order:
        order = np.tile(np.arange(len(scores)), (len(shares), 1))
    order = order[:, :_REASONS]
    ranked = np.take_along_axis(percentiles, order, axis=1)
    shown = ~np.isnan(ranked) if in_order else np.nan_to_num(ranked) >= _NOTABLE
    shown[:, 0] |= ~shown.any(axis=1) & ~np.isnan(ranked[:, 0])
    return np.where(shown, order, -1)


def _texts(score: ExplainedScore) -> tuple[list[str], NDArray[np.int64]]:
    """The texts of a score, and for every clip the number of its own; int64 [n]. Those without a value mean nothing."""
    values = np.nan_to_num(score.values)
    values[np.abs(values) < _POWERS_OF_TEN[_DIGITS]] = 0.0
    place = np.searchsorted(_POWERS_OF_TEN, np.abs(values), side="right") - _DIGITS  # of the last digit shown
    place[values == 0] = -_LEAST_POWER
    digits = np.rint(values / _POWERS_OF_TEN[place]).astype(np.int64)
    shares = np.nan_to_num(score.percentiles.astype(np.float64))
    below = 1 - shares if score.info.direction is Direction.LOWER else shares
    percent = np.clip(np.floor(100 * below + _ROUNDING), 1, 99).astype(np.int64)
    parts = np.stack([place + _LEAST_POWER, digits, percent])
    spans = parts.max(axis=1, initial=0) - parts.min(axis=1, initial=0) + 1
    code = np.ravel_multi_index(tuple(parts - parts.min(axis=1, initial=0)[:, None]), tuple(spans))
    _, first, numbers = np.unique(code, return_index=True, return_inverse=True)
    label, unit = score_label(score.info), score.info.unit
    texts = [
        f"{label} {value_text(float(f'{digit}e{exponent}'), unit)} ({_ordinal(share)} percentile)"
        for exponent, digit, share in parts[:, first].T.tolist()
    ]
    return texts, numbers.astype(np.int64)


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
