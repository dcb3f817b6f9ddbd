"""Selections from a release of six small clips, and what surveys of them find."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
from walled_release import UNITS, build_release

from pipelines.running.settings import settings_of
from wsm_data.curation.path_outline import PATH_POINTS, Outlines
from wsm_data.curation.quotas import Limits, Quota, QuotaConfig
from wsm_data.curation.rule import RuleConfig
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable, write_scores
from wsm_data.curation.select import INDEX_COLUMNS, SelectionConfig, select_clips
from wsm_data.curation.survey import SelectionSurvey, SelectionSurveyConfig, survey_selection
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import Selection, selection_path, write_selection


@pytest.fixture(scope="session")
def selected(tmp_path_factory) -> SimpleNamespace:
    """A release with scores and three selections: `hard`, a part of it, and one of another release."""
    units = dict.fromkeys(list(UNITS)[:4], "train") | dict.fromkeys(list(UNITS)[4:], "test")
    release = build_release(tmp_path_factory.mktemp("selected"), units)
    folder, digest = Path(release.store.root), release_digest(release.manifest)
    index = release.index.columns(INDEX_COLUMNS)
    count = len(index)
    columns = {
        "detour_ratio": np.linspace(1.0, 3.0, count),
        "clearance_least_m": np.linspace(0.6, 0.2, count),
        "retreat_m": np.where(np.asarray(index["split"].to_pylist()) == "test", np.nan, 1.0),
    }
    first_of_split = index["split"].to_pylist().index("train")
    columns["retreat_m"][first_of_split] = np.nan
    infos = tuple(
        ScorerInfo(
            name=name,
            unit="m" if name.endswith("_m") else "ratio",
            direction=Direction.LOWER if name == "clearance_least_m" else Direction.HIGHER,
            summary=f"invented <b>bold</b> {name}",
            absent="no dead end" if name == "retreat_m" else "",
        )
        for name in columns
    )
    keys = pa.array(index["key"].to_pylist())
    scores = ScoreTable(release_digest=digest, scorers=infos, keys=keys, columns=columns)
    outlines = Outlines(
        xy_m=np.zeros((count, PATH_POINTS, 2), np.float32) + 10 * np.arange(count, dtype=np.float32)[:, None, None],
        floor_z_m=np.zeros(count, np.float32),
    )
    write_scores(folder / "scores.parquet", scores, outlines)
    config = SelectionConfig(
        fraction=0.5,
        rule=RuleConfig(weights={"detour_ratio": 3.0, "clearance_least_m": 1.0}),
        quotas=QuotaConfig(scene=Quota(at_most=1), camera=Quota(named={"zed": Limits(at_least=1)})),
    )
    chosen = select_clips(index, scores, outlines.take, config)
    selection = Selection(
        name="hard",
        release_digest=digest,
        rule={
            "settings": {"name": "hard", **settings_of(config)},
            "clips": {
                "of the split": chosen.trajectories,
                "excluded": dict(chosen.excluded),
                "near-duplicates left out": chosen.near_duplicates,
                "over quota": chosen.over_quota,
            },
        },
        command="wsm select RELEASE --set fraction=0.5",
        keys=keys.take(pa.array(chosen.rows)),
        scores=chosen.difficulty,
        why=chosen.why,
    )
    part = replace(selection, name="other", **{one: getattr(selection, one)[:1] for one in ("keys", "scores", "why")})
    for one in (selection, part, replace(selection, name="stale", release_digest="0" * 64)):
        write_selection(folder / selection_path(one.name), one)
    return SimpleNamespace(
        release=release,
        scores=str(folder / "scores.parquet"),
        config=config,
        selection=selection,
        detour_of_split=columns["detour_ratio"][np.asarray(index["split"].to_pylist()) == "train"].tolist(),
    )


@pytest.fixture
def survey_of(selected, tmp_path) -> Callable[..., SelectionSurvey]:
    """Surveys a selection of two of the four training clips, by scores that are given for them, in the file's order.

    `paths` are numbers of paths: clips of one number are near-duplicates.
    """

    def make(rule: RuleConfig, paths: Sequence[int] = (0, 1, 2, 3), **scores: Sequence[float]) -> SelectionSurvey:
        release, digest = selected.release, release_digest(selected.release.manifest)
        index = release.index.columns(INDEX_COLUMNS)
        train = np.flatnonzero(np.asarray(index["split"].to_pylist()) == "train")
        columns = {name: np.full(len(index), np.nan) for name in scores}
        for name, values in scores.items():
            columns[name][train] = values
        infos = tuple(
            ScorerInfo(name=name, unit="ratio", direction=Direction.HIGHER, summary="invented", absent="none")
            for name in scores
        )
        table = ScoreTable(
            release_digest=digest, scorers=infos, keys=pa.array(index["key"].to_pylist()), columns=columns
        )
        xy_m = np.zeros((len(index), PATH_POINTS, 2), np.float32)
        xy_m[train] += 10 * np.array(paths, np.float32)[:, None, None]
        outlines = Outlines(xy_m=xy_m, floor_z_m=np.zeros(len(index), np.float32))
        write_scores(tmp_path / "scores.parquet", table, outlines)
        # the four clips are of one physical scene, so that paths of one number are near
        alike = index.set_column(
            index.column_names.index("physical_scene"), "physical_scene", pa.array(["s"] * len(index))
        )
        config = SelectionConfig(fraction=0.5, rule=rule)
        chosen = select_clips(alike, table, outlines.take, config)
        selection = replace(
            selected.selection,
            name="tried",
            rule={**selected.selection.rule, "settings": {"name": "tried", **settings_of(config)}},
            keys=table.keys.take(pa.array(chosen.rows)),
            scores=chosen.difficulty,
            why=chosen.why,
        )
        write_selection(tmp_path / "tried.parquet", selection)
        shown = SelectionSurveyConfig(hardest=1, borderline=1, samples=0)
        names = (str(tmp_path / "tried.parquet"), str(tmp_path / "scores.parquet"))
        return survey_selection(release, *names, shown)

    return make
