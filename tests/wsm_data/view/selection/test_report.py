import re

import pytest

from wsm_data.curation.rule import RuleConfig, RuleKind
from wsm_data.curation.survey import SelectionSurveyConfig, survey_selection
from wsm_data.shards.manifest import release_digest
from wsm_data.view.selection.report import selection_html, write_selection_report

SHOWN = SelectionSurveyConfig(hardest=1, borderline=1, samples=3)


@pytest.fixture(scope="module")
def html(selected, made):
    survey = survey_selection(selected.release, "hard", selected.scores, SHOWN)
    return selection_html(selected.release, survey, made.codec)


def text_of(html):
    body = re.sub(r"<style>.*?</style>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", body))


def test_the_page_loads_nothing_and_runs_nothing(html):
    links = re.findall(r'\b(?:src|href)="([^"]*)"', html)
    assert links
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in links)
    assert not re.search(r"url\((?!#)|@import|<script|<link|\son\w+=", re.sub(r"data:[^\"]*", "", html))


def test_what_was_chosen_and_why_is_said(html, selected):
    text = text_of(html)
    for words in ("2 clips chosen", "50.0 % of 4 in train", "detour", "clearance least", "wsm select RELEASE"):
        assert words in text
    assert release_digest(selected.release.manifest) in text
    for key, why in zip(selected.selection.keys.to_pylist(), selected.selection.why.to_pylist(), strict=True):
        assert why in text
        assert key in text


def test_every_score_has_a_distribution_and_every_shown_clip_pictures_and_a_map(html):
    assert html.count('aria-label="Distribution of') == 1 + 3  # difficulty and three scores
    assert html.count("<article>") == 3
    assert html.count('alt="decoded RGB') == html.count('alt="decoded depth') == 3 * 6
    assert html.count('aria-label="Map and path of') == 3


def test_ids_are_unique(html):
    found = re.findall(r'\bid="([^"]+)"', html)
    assert len(found) == len(set(found))


def test_overlaps_and_quotas_are_shown(html):
    text = text_of(html)
    for words in ("other 1 1 0.500", "the same rule under bootstrap", "By camera", "not chosen"):
        assert words in text


def test_a_lexicographic_rule_is_told_in_its_own_words_and_order(survey_of, selected, made):
    rule = RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=("cost", "unsafe"))
    survey = survey_of(rule, unsafe=[0.1, 0.9, 0.5, 0.2], cost=[5, 5, 5, 1])
    text = text_of(selection_html(selected.release, survey, made.codec))
    assert "tells each chosen clip from the first one that was left out" in text
    assert "weighted share" not in text
    assert text.index("cost higher is harder 1.") < text.index("unsafe higher is harder 2.")


def test_what_stands_at_the_border_is_said(html):
    assert "the hardest that were not, of those no harder than the easiest chosen one" in text_of(html)


def test_hostile_text_is_text(html):
    assert "<b>bold</b>" not in html
    assert "&lt;b&gt;bold&lt;/b&gt;" in html


def test_equal_selections_have_equal_pages(html, selected, made, tmp_path):
    path = tmp_path / "page.html"
    write_selection_report(selected.release, "hard", selected.scores, made.codec, path, SHOWN)
    assert path.read_text() == html
