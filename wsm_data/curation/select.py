"""Choose the hard share of the training trajectories: rule, exclusion, quotas and diversity put together.

A pure function of the index, the scores and the settings: neither threads nor the order in which files are read change
what is chosen.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from wsm_data.curation.choose import PathReader, choose_clips
from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.exclusion import Excluded, ExclusionConfig, excluded_clips
from wsm_data.curation.explain import ExplainedScore, explain_clips
from wsm_data.curation.key_order import key_hashes
from wsm_data.curation.quotas import QUOTA_COLUMNS, QuotaConfig, column_codes, quota_table
from wsm_data.curation.rule import Rating, RuleConfig, RuleKind, rate_clips, ruling_scores
from wsm_data.curation.scores_table import ScorerInfo, ScoreTable
from wsm_data.curation.split import TRAIN
from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import Float64Array

INDEX_COLUMNS = ("key", "split", *QUOTA_COLUMNS.values())
"""What a selection reads of the index."""


@dataclass(frozen=True, kw_only=True)
class SelectionConfig:
    """How a selection is made.

    Attributes:
        fraction: share of the trajectories of the split that is chosen, above 0 and up to 1; the paper post-trains on
            about 10 % of the training trajectories.
        split: split that is chosen from.
        rule: what hard means.
        exclude: clips that are never chosen.
        quotas: bounds by scene, group and camera.
        diversity: when two paths count as one.
    """

    fraction: float = 0.1
    split: str = TRAIN
    rule: RuleConfig = field(default_factory=RuleConfig)
    exclude: ExclusionConfig = field(default_factory=ExclusionConfig)
    quotas: QuotaConfig = field(default_factory=QuotaConfig)
    diversity: DiversityConfig = field(default_factory=DiversityConfig)

    def __post_init__(self) -> None:
        if not 0 < self.fraction <= 1:
            raise ValueError(f"fraction must be above 0 and at most 1, found {self.fraction}")

    def score_names(self, scorers: tuple[ScorerInfo, ...]) -> tuple[str, ...]:
        """Names of the scores that are read, of those there are.

        Raises:
            ConfigError: rule or exclusion names a score that is not there, or the rule one that has no hard end.
        """
        ruling = [one.name for one in ruling_scores(scorers, self.rule)]
        return tuple(dict.fromkeys([*ruling, *self.exclude.scores(scorers)]))


@dataclass(frozen=True, kw_only=True, eq=False)
class ChosenClips:
    """The outcome of a selection.

    Attributes:
        rows: chosen rows of the index, hardest first; int64 [n].
        difficulty: under the rule, in [0, 1]; float64 [n].
        why: which scores made each clip hard; text [n].
        trajectories: clips of the split.
        excluded: clips of the split that were left out, by reason.
        near_duplicates: clips left out for one on nearly the same path that was taken before.
        over_quota: clips left out because a quota was full.
    """

    rows: NDArray[np.int64]
    difficulty: Float64Array
    why: pa.StringArray
    trajectories: int
    excluded: Mapping[str, int]
    near_duplicates: int
    over_quota: int


def select_clips(
    index: pa.Table,
    scores: ScoreTable,
    read_paths: PathReader,
    config: SelectionConfig,
) -> ChosenClips:
    """Choose clips.

    Args:
        index: the columns `INDEX_COLUMNS` of the release's index.
        scores: scores of the same clips in the same order.
        read_paths: from rows of the index to the outlines of their paths.
        config: how.

    Raises:
        ConfigError: the split has no clip, the rule names an unknown score, a clip has no score of the rule, or the
            quotas cannot be met.
    """
    rows = np.flatnonzero(np.asarray(pc.equal(index["split"], config.split)))
    count = _count(len(rows), config)
    excluded = excluded_clips(scores, config.exclude, config.rule.scores, rows)
    candidates = rows[~excluded.clips]
    _require_enough(len(candidates), count, excluded, config)
    rating = rate_clips(scores, config.rule, candidates)
    walk = hardest_first(rating.difficulty, key_hashes(scores.keys)[candidates])
    ordered = index.select(list(QUOTA_COLUMNS.values())).take(pa.array(candidates[walk]))
    chosen = choose_clips(
        quota_table(config.quotas, ordered, count),
        column_codes(ordered[QUOTA_COLUMNS["scene"]])[1],
        count,
        config.diversity.within_m,
        lambda places: read_paths(candidates[walk[places]]),
    )
    taken = walk[chosen.places]
    explained = explained_scores(scores, config.rule, rating, candidates, taken)
    return ChosenClips(
        rows=candidates[taken],
        difficulty=rating.difficulty[taken],
        why=explain_clips(explained, in_order=config.rule.kind is RuleKind.LEXICOGRAPHIC),
        trajectories=len(rows),
        excluded=excluded.counts,
        near_duplicates=chosen.near_duplicates,
        over_quota=chosen.over_quota,
    )


def hardest_first(difficulty: Float64Array, hashes: NDArray[np.uint64]) -> NDArray[np.int64]:
    """Order of clips from the hardest down, equal ones by their hash; int64 [M].

    As `np.lexsort((hashes, -difficulty))`, and faster: few clips are equal, and only they are sorted twice.
    """
    order = np.argsort(-difficulty)
    equal = difficulty[order[1:]] == difficulty[order[:-1]]
    tied = np.flatnonzero(np.append(equal, False) | np.insert(equal, 0, False))
    group = np.cumsum(~np.insert(equal, 0, False))[tied]
    clips = order[tied]
    order[tied] = clips[np.lexsort((clips, hashes[clips], group))]
    return order


def explained_scores(
    scores: ScoreTable, rule: RuleConfig, rating: Rating, rated: NDArray[np.int64], of: NDArray[np.int64]
) -> list[ExplainedScore]:
    """What the scores of a rule say of some of the clips that were rated.

    Args:
        scores: the scores of the release.
        rule: the rule.
        rating: what `rate_clips` returned for `rated`.
        rated: rows of the index, int64 [M].
        of: which of the rated clips, as numbers in `rated`; int64 [n].
    """
    infos = {one.name: one for one in scores.scorers}
    return [
        ExplainedScore(
            info=infos[name],
            weight=weight,
            emphasis=rule.emphasis,
            values=scores.columns[name][rated[of]],
            percentiles=rating.percentiles[name][of],
        )
        for name, weight in rule.score_weights.items()
    ]


def _count(trajectories: int, config: SelectionConfig) -> int:
    """Clips to choose: the fraction of the trajectories, rounded, and at least one."""
    if not trajectories:
        raise ConfigError(f"the release has no clip of the split {config.split!r}; set split to one it has")
    return max(1, int(config.fraction * trajectories + 0.5))


def _require_enough(candidates: int, count: int, excluded: Excluded, config: SelectionConfig) -> None:
    if candidates < count:
        reasons = ", ".join(f"{number} by {reason}" for reason, number in excluded.counts.items())
        raise ConfigError(
            f"fraction {config.fraction:g} asks for {count} clips, and {candidates} are left; excluded are {reasons}; "
            "choose a smaller fraction, or exclude fewer"
        )
