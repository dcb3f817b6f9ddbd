import numpy as np
import pyarrow as pa
import pytest
from walled_release import UNITS, build_release

from wsm_data.curation.key_order import key_hashes
from wsm_data.curation.rule import RuleConfig, RuleKind
from wsm_data.curation.survey import SelectionSurveyConfig, selection_settings, survey_selection
from wsm_data.errors import ConfigError
from wsm_data.shards.selection import selection_path, write_selection

SHOWN = SelectionSurveyConfig(hardest=1, borderline=1, samples=3)


@pytest.fixture(scope="module")
def survey(selected):
    return survey_selection(selected.release, "hard", selected.scores, SHOWN)


def test_the_settings_are_read_from_the_selection(survey, selected):
    assert survey.config == selected.config == selection_settings(survey.selection)


def test_scores_are_those_of_the_split_and_of_the_chosen_the_rule_first(survey, selected):
    first, second, third = survey.scores
    assert (first.info.name, first.weight) == ("detour_ratio", 0.75)
    assert (second.info.name, second.weight) == ("clearance_least_m", 0.25)
    assert third.weight == third.leads == 0
    assert sorted(first.values) == sorted(selected.detour_of_split)
    assert sorted(first.chosen) == sorted(selected.detour_of_split)[-2:]
    assert first.leads + second.leads == 2


def test_a_score_that_some_clips_do_not_have_is_shown_of_the_others(survey, selected):
    assert len(survey.scores[2].values) == 3


def test_quotas_are_counted_as_they_were_filled(survey):
    cameras = {one.place: one for one in survey.places["camera"]}
    assert sum(one.chosen for one in cameras.values()) == 2
    assert sum(one.available for one in cameras.values()) == 4
    assert (cameras["zed"].least, cameras["zed"].most) == (1, None)
    assert all(one.most == 1 for one in survey.places["scene"])


def test_the_hardest_and_both_sides_of_the_border_are_shown(survey, selected):
    assert [one.rank for one in survey.hardest] == [1]
    assert [one.rank for one in survey.borderline] == [2, None]
    keys = [one.key for one in (*survey.hardest, *survey.borderline)]
    assert keys[:2] == survey.selection.keys.to_pylist()
    assert keys[2] not in keys[:2]
    assert survey.hardest[0].difficulty == survey.selection.scores[0]
    assert survey.hardest[0].why == survey.selection.why[0].as_py()


def test_other_selections_are_compared_and_those_of_other_releases_passed_over(survey):
    assert [(name, clips, common) for name, clips, common, _ in survey.others] == [("other", 1, 1)]
    assert survey.others[0][3] == pytest.approx(1 / 2)


def test_the_rule_is_tried_on_samples(survey):
    assert len(survey.bootstrap.jaccard) + survey.bootstrap.unmet == 3


def test_the_list_is_that_of_the_file(survey):
    assert [row[:2] for row in survey.listed] == list(enumerate(survey.selection.keys.to_pylist(), start=1))


def test_a_selection_of_another_release_is_refused(selected, tmp_path):
    other = build_release(tmp_path, dict(list(UNITS.items())[:3]))
    write_selection(tmp_path / "release" / selection_path("hard"), selected.selection)
    with pytest.raises(ConfigError, match="was made from the release with digest"):
        survey_selection(other, "hard", selected.scores, SHOWN)


def test_at_the_border_stand_the_last_that_was_chosen_and_the_first_that_is_no_harder(survey_of, selected):
    """The second clip is a near-duplicate of the first: it is harder than the last one that was chosen."""
    survey = survey_of(RuleConfig(weights={"detour_ratio": 1.0}), paths=(0, 0, 1, 2), detour_ratio=[4, 3, 2, 1])
    index = selected.release.index.columns(["key", "split"])
    train = [row["key"] for row in index.to_pylist() if row["split"] == "train"]
    assert survey.selection.keys.to_pylist() == [train[0], train[2]]
    assert [(one.rank, one.key) for one in survey.borderline] == [(2, train[2]), (None, train[3])]


def test_clips_as_hard_as_the_easiest_chosen_one_are_left_out_in_the_order_of_the_walk(survey_of, selected):
    survey = survey_of(RuleConfig(weights={"detour_ratio": 1.0}), detour_ratio=[1, 1, 1, 1])
    index = selected.release.index.columns(["key", "split"])
    train = [row["key"] for row in index.to_pylist() if row["split"] == "train"]
    walk = [train[number] for number in np.argsort(key_hashes(pa.array(train)))]
    assert survey.selection.keys.to_pylist() == walk[:2]
    assert [one.key for one in survey.borderline] == [walk[1], walk[2]]


def test_scores_of_a_lexicographic_rule_stand_in_its_order_and_lead_by_what_told_clips_apart(survey_of):
    """All but the last clip cost the same: both chosen ones are told from the third by how unsafe they are."""
    rule = RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=("cost", "unsafe"))
    survey = survey_of(rule, unsafe=[0.1, 0.9, 0.5, 0.2], cost=[5, 5, 5, 1])
    assert [(one.info.name, one.leads) for one in survey.scores] == [("cost", 0), ("unsafe", 2)]
