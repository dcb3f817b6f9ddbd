"""What a selection came to: its scores and quotas beside those of all clips, and the clips at its top and border."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from wsm_data.access.release import Release
from wsm_data.curation.exclusion import excluded_clips
from wsm_data.curation.explain import ExplainedScore, deciding_scores, explain_clips, leading_scores
from wsm_data.curation.key_order import key_hashes
from wsm_data.curation.quotas import QUOTA_COLUMNS, column_codes, quota_table
from wsm_data.curation.rule import RuleKind, rate_clips
from wsm_data.curation.scores_table import ScorerInfo, ScoreTable, read_paths, read_scores
from wsm_data.curation.select import INDEX_COLUMNS, SelectionConfig, explained_scores, hardest_first
from wsm_data.curation.stability import BootstrapOverlap, bootstrap_overlap, jaccard
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config
from wsm_data.schema.arrays import Float64Array
from wsm_data.shards.selection import Selection, read_selection, selection_names


@dataclass(frozen=True, kw_only=True)
class SelectionSurveyConfig:
    """How much of a selection is looked at one by one.

    Attributes:
        hardest: clips from the top.
        borderline: clips on either side of the border.
        listed: clips in the list of reasons.
        samples: bootstrap samples.
    """

    hardest: int = 5
    borderline: int = 2
    listed: int = 100
    samples: int = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreSurvey:
    """One score over all clips of the split, and over the chosen ones.

    Attributes:
        info: the score.
        weight: its share in the rule; 0 where the rule does not read it.
        leads: chosen clips that it made hard: by the largest share of their difficulty, or, where a rule goes by the
            order of scores, by telling them from the first clip that was left out.
        values: of the clips of the split that have one; float64.
        chosen: of the chosen ones; float64.
    """

    info: ScorerInfo
    weight: float
    leads: int
    values: Float64Array
    chosen: Float64Array


@dataclass(frozen=True, kw_only=True)
class PlaceCount:
    """How a quota was filled.

    Attributes:
        place: such as `camera zed`.
        available: clips of the split.
        chosen: of these.
        least: fewest that had to be chosen.
        most: most that could be; None where there was no bound.
    """

    place: str
    available: int
    chosen: int
    least: int
    most: int | None


@dataclass(frozen=True, kw_only=True)
class SurveyedClip:
    """A clip that stands for others.

    Attributes:
        key: the clip.
        rank: 1 for the hardest; None for one that was not chosen.
        difficulty: under the rule, in [0, 1].
        why: what makes it hard.
    """

    key: str
    rank: int | None
    difficulty: float
    why: str


@dataclass(frozen=True, kw_only=True, eq=False)
class SelectionSurvey:
    """What is known of a selection.

    Attributes:
        selection: the selection.
        config: how it was made.
        scores: every score there is, those of the rule first: by weight, and in its order.
        difficulty: of the candidates, float64; those that were chosen have the largest, but for quotas and duplicates.
        places: quotas and how they were filled, by kind.
        hardest: clips from the top.
        borderline: the last that were chosen, and the first that are no harder and were not.
        others: name, clips, common clips and Jaccard index of the release's other selections.
        bootstrap: the same rule under bootstrap.
        listed: rank, key, difficulty and reasons of the first clips.
    """

    selection: Selection
    config: SelectionConfig
    scores: tuple[ScoreSurvey, ...]
    difficulty: Float64Array
    places: dict[str, tuple[PlaceCount, ...]]
    hardest: tuple[SurveyedClip, ...]
    borderline: tuple[SurveyedClip, ...]
    others: tuple[tuple[str, int, int, float], ...]
    bootstrap: BootstrapOverlap
    listed: tuple[tuple[int, str, float, str], ...]


def survey_selection(
    release: Release, name: str, scores_location: str, shown: SelectionSurveyConfig | None = None
) -> SelectionSurvey:
    """Rate the clips again as the selection did. No clip is read.

    Args:
        release: the release.
        name: name of the selection, or path of its file.
        scores_location: the scores it was made from.
        shown: how much is looked at.

    Raises:
        ConfigError: selection or scores are of another release.
    """
    shown = shown or SelectionSurveyConfig()
    digest = release.digest
    selection = read_selection(release.store, name, digest, release.index)
    config = selection_settings(selection)
    scores = read_scores(scores_location, release_digest=digest, release_keys=release.index.columns(["key"])["key"])
    index = release.index.columns(INDEX_COLUMNS)
    rows = release.index.rows_of(selection.keys)
    state = _rated(index, scores, config, rows)
    last = max(shown.hardest, len(rows) - shown.borderline)
    border = (*state.chosen[last:], *state.left[: shown.borderline])
    return SelectionSurvey(
        selection=selection,
        config=config,
        scores=_score_surveys(state),
        difficulty=state.difficulty,
        places=_places(state, selection),
        hardest=tuple(_surveyed(state, number) for number in state.chosen[: shown.hardest]),
        borderline=tuple(_surveyed(state, number) for number in border),
        others=_others(release, selection, digest, rows),
        bootstrap=bootstrap_overlap(
            index, scores, partial(read_paths, scores_location), config, rows, samples=shown.samples
        ),
        listed=_listed(selection, shown.listed),
    )


def selection_settings(selection: Selection) -> SelectionConfig:
    """The settings that a selection states."""
    settings: dict[str, Any] = {key: value for key, value in selection.rule["settings"].items() if key != "name"}
    return build_config(SelectionConfig, settings)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rated:
    """The clips a selection was made from. Candidates are numbered; excluded clips are none.

    Attributes:
        index: columns of the index.
        scores: all scores.
        config: how was selected.
        split: rows of the split.
        chosen_rows: rows of the chosen clips, hardest first.
        difficulty: of each candidate.
        chosen: chosen candidates, hardest first.
        left: those of the others that are no harder than the easiest chosen one, in the order of the walk. Harder
            ones were passed over: near-duplicates, and clips over a quota.
        rows: row of each candidate.
        why: reasons of each candidate.
        leading: which score of the rule made each chosen clip hardest.
    """

    index: pa.Table
    scores: ScoreTable
    config: SelectionConfig
    split: NDArray[np.int64]
    chosen_rows: NDArray[np.int64]
    difficulty: Float64Array
    chosen: NDArray[np.int64]
    left: NDArray[np.int64]
    rows: NDArray[np.int64]
    why: pa.StringArray
    leading: NDArray[np.int64]


def _rated(index: pa.Table, scores: ScoreTable, config: SelectionConfig, chosen_rows: NDArray[np.int64]) -> _Rated:
    codes, splits = column_codes(index["split"])[1], column_codes(index["split"])[0]
    split = np.flatnonzero(codes == splits.index(config.split))
    rows = split[~excluded_clips(scores, config.exclude, config.rule.scores, split).clips]
    rating = rate_clips(scores, config.rule, rows)
    everybody = np.arange(len(rows))
    explained = explained_scores(scores, config.rule, rating, rows, everybody)
    number = np.full(len(index), -1, np.int64)
    number[rows] = everybody
    chosen = number[chosen_rows]
    walk = hardest_first(rating.difficulty, key_hashes(scores.keys)[rows])
    easiest = rating.difficulty[chosen].min()
    left = walk[(rating.difficulty[walk] <= easiest) & ~np.isin(walk, chosen)]
    return _Rated(
        index=index,
        scores=scores,
        config=config,
        split=split,
        chosen_rows=chosen_rows,
        difficulty=rating.difficulty,
        chosen=chosen,
        left=left,
        rows=rows,
        why=explain_clips(explained, in_order=config.rule.kind is RuleKind.LEXICOGRAPHIC),
        leading=_leading(explained, config, left)[chosen],
    )


def _leading(
    explained: Sequence[ExplainedScore], config: SelectionConfig, left: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Which score of the rule made each candidate hard."""
    if config.rule.kind is RuleKind.WEIGHTED:
        return leading_scores(explained)
    return deciding_scores(explained, int(left[0]) if len(left) else None)


def _score_surveys(state: _Rated) -> tuple[ScoreSurvey, ...]:
    weights = state.config.rule.score_weights
    leads = dict(zip(weights, np.bincount(state.leading, minlength=len(weights)).tolist(), strict=True))
    total = sum(weights.values())
    surveys = [
        ScoreSurvey(
            info=info,
            weight=weights.get(info.name, 0.0) / total,
            leads=leads.get(info.name, 0),
            values=_known(state.scores.columns[info.name][state.split]),
            chosen=_known(state.scores.columns[info.name][state.chosen_rows]),
        )
        for info in state.scores.scorers
    ]
    place = {name: number for number, name in enumerate(weights)}
    return tuple(sorted(surveys, key=lambda one: (-one.weight, place.get(one.info.name, len(place)))))


def _known(values: Float64Array) -> Float64Array:
    return values[~np.isnan(values)]


def _places(state: _Rated, selection: Selection) -> dict[str, tuple[PlaceCount, ...]]:
    """Counts of every place among the candidates, most chosen first."""
    candidates = state.index.take(pa.array(state.rows))
    table = quota_table(state.config.quotas, candidates, len(selection))
    found = {}
    for kind, codes in zip(QUOTA_COLUMNS, table.codes, strict=True):
        available = np.bincount(codes, minlength=len(table.names))
        chosen = np.bincount(codes[state.chosen], minlength=len(table.names))
        counts = [
            PlaceCount(
                place=table.names[place].removeprefix(f"{kind} "),
                available=int(available[place]),
                chosen=int(chosen[place]),
                least=int(table.least[place]),
                most=int(table.most[place]) if table.most[place] < len(selection) else None,
            )
            for place in np.unique(codes)
        ]
        found[kind] = tuple(sorted(counts, key=lambda one: (-one.chosen, one.place)))
    return found


def _surveyed(state: _Rated, number: int) -> SurveyedClip:
    place = np.flatnonzero(state.chosen == number)
    return SurveyedClip(
        key=state.index["key"][int(state.rows[number])].as_py(),
        rank=int(place[0]) + 1 if len(place) else None,
        difficulty=float(state.difficulty[number]),
        why=state.why[int(number)].as_py(),
    )


def _others(
    release: Release, selection: Selection, digest: str, rows: NDArray[np.int64]
) -> tuple[tuple[str, int, int, float], ...]:
    """The other selections that stand in the release and are of it."""
    found = []
    for name in selection_names(release.store):
        if name == selection.name:
            continue
        try:
            other = release.index.rows_of(read_selection(release.store, name, digest).keys)
        except ConfigError:  # of an earlier state of the release
            continue
        found.append((name, len(other), len(np.intersect1d(rows, other)), jaccard(rows, other)))
    return tuple(found)


def _listed(selection: Selection, count: int) -> tuple[tuple[int, str, float, str], ...]:
    columns = (selection.ranks[:count].tolist(), selection.keys[:count].to_pylist())
    return tuple(zip(*columns, selection.scores[:count].tolist(), selection.why[:count].to_pylist(), strict=True))
