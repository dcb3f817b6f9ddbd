"""What is not worth training on: clips that nobody could get right, and whatever else a selection leaves out."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from wsm_data.curation.scores_table import ScorerInfo, ScoreTable
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.schema.arrays import BoolArray

HOPELESS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {"goal_reachable": ("at most", 0.0), "rollout_all_unsafe": ("at least", 1.0)}
)
"""The goal cannot be reached on the map; every query of every policy that was rolled out was unsafe."""

UNSCORED = "having no score of the rule"
"""The reason of `ExclusionConfig.unscored`."""

_NO_BOUNDS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class ExclusionConfig:
    """Clips that are never chosen. They count as training trajectories when a fraction of those is taken.

    Attributes:
        hopeless: leave out clips whose goal cannot be reached, or that are 100 % unsafe for all policies; by the scores
            of `HOPELESS`, as far as they are there.
        unscored: leave out clips that have none of the scores of the rule, such as those that were not rolled out; else
            they are refused.
        at_least: leave out clips whose score is this or more, by the name of the score.
        at_most: leave out clips whose score is this or less.
    """

    hopeless: bool = True
    unscored: bool = False
    at_least: Mapping[str, float] = field(default_factory=lambda: _NO_BOUNDS)
    at_most: Mapping[str, float] = field(default_factory=lambda: _NO_BOUNDS)

    def __post_init__(self) -> None:
        for side in ("at_least", "at_most"):
            for name, bound in getattr(self, side).items():
                if not math.isfinite(bound):
                    raise ValueError(f"{side}.{name} must be a finite number, found {bound}")

    def scores(self, scorers: Sequence[ScorerInfo]) -> tuple[str, ...]:
        """Names of the scores that are looked at, of those there are.

        Raises:
            ConfigError: a bound names a score that is not there.
        """
        known = {one.name for one in scorers}
        for name in (*self.at_least, *self.at_most):
            if name not in known:
                raise ConfigError(f"exclude names the score {name!r}, which is not there; {did_you_mean(name, known)}")
        hopeless = [name for name in HOPELESS if name in known] if self.hopeless else []
        return tuple(dict.fromkeys([*hopeless, *self.at_least, *self.at_most]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Excluded:
    """Which clips are left out, and why.

    Attributes:
        clips: bool [M].
        counts: clips by reason, such as `goal_reachable at most 0`; a clip counts under the first of its reasons.
    """

    clips: BoolArray
    counts: Mapping[str, int]


def excluded_clips(
    scores: ScoreTable, config: ExclusionConfig, rule_scores: Sequence[str], rows: NDArray[np.int64]
) -> Excluded:
    """Find the clips that are left out. A clip without a value of a score is not left out by it.

    Args:
        scores: the scores of a release.
        config: what is left out.
        rule_scores: names of the scores of the rule.
        rows: rows of the clips in question, int64 [M].

    Raises:
        ConfigError: a bound names a score that is not there.
    """
    config.scores(scores.scorers)
    clips, counts = np.zeros(len(rows), bool), {}
    for name, side, bound in _bounds(scores, config):
        values = scores.columns[name][rows]
        out = (values >= bound if side == "at least" else values <= bound) & ~clips
        counts[f"{name} {side} {bound:g}"] = int(out.sum())
        clips |= out
    if config.unscored:
        out = np.all([np.isnan(scores.columns[name][rows]) for name in rule_scores], axis=0) & ~clips
        counts[UNSCORED] = int(out.sum())
        clips |= out
    return Excluded(clips=clips, counts=counts)


def _bounds(scores: ScoreTable, config: ExclusionConfig) -> Iterator[tuple[str, str, float]]:
    if config.hopeless:
        yield from ((name, *bound) for name, bound in HOPELESS.items() if name in scores.columns)
    yield from ((name, "at least", bound) for name, bound in config.at_least.items())
    yield from ((name, "at most", bound) for name, bound in config.at_most.items())
