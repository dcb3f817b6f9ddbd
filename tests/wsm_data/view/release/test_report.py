import re
from html.parser import HTMLParser

import pytest

from wsm_data.shards.manifest import release_digest
from wsm_data.view.release.clip_survey import ClipSurvey, SurveyConfig, survey_clips
from wsm_data.view.release.report import report_html, write_report
from wsm_data.view.release.report_data import ReportData, StageSummary

STAGES = (
    StageSummary(
        name="index",
        version=1,
        units=9,
        done=8,
        refused=1,
        seconds=3.5,
        wall_seconds=2.5,
        workers=2,
        fingerprint="f00d" * 16,
    ),
    StageSummary(name="encode", version=2, units=8, done=6, refused=2, seconds=122.25, wall_seconds=61.25, workers=2),
)
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Checks that elements are closed in order, and collects text, links and elements by name."""

    def __init__(self, html):
        super().__init__()
        self.open, self.elements, self.links, self.words = [], [], [], []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self._note(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self._note(tag, attrs)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.words.append(data)

    def _note(self, tag, attrs):
        self.elements.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href", "srcset", "data", "action", "poster")]

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.words))


@pytest.fixture(scope="module")
def data(release, made):
    return ReportData(survey=survey_clips(release, made.codec), stages=STAGES)


@pytest.fixture(scope="module")
def html(data, release):
    return report_html(data, release)


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_the_file_is_well_formed_and_self_contained(html, page):
    assert page.links
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in page.links)
    assert not re.search(r"url\((?!#)", html)
    assert "@import" not in html
    assert not {"link", "iframe", "object", "embed", "base", "form"} & set(page.elements)


def test_it_runs_no_script(html, page):
    assert "script" not in page.elements
    assert not re.search(r"\son\w+=", re.sub(r'"[^"]*"', '""', html))


def test_the_headline_numbers_are_there_and_hours_are_not_invented(page, release):
    for words in ("6 clips", "54 frames", "4 physical scenes", "3 units dropped", "unknown hours"):
        assert words in page.text
    assert release_digest(release.manifest) in page.text


def test_every_reason_stands_with_its_example(page):
    for words in ("archive.truncated", "synth_zed/home_0009", "path.through_obstacle", "synth_d435i/home_0002/000007"):
        assert words in page.text


def test_the_leak_between_splits_is_said(page):
    assert "1 of 2 held-out scenes also occur in training" in page.text


def test_hostile_names_are_text_not_markup(html, page, made):
    assert made.hostile_scene in page.text
    assert "<script" not in html
    assert "ends <b>early</b>" in page.text
    assert "small <i>homes</i>" in page.text


def test_codec_quality_is_in_decibels_and_metres(page):
    assert "26.0 dB" in page.text
    assert "0.2 to 1.0 m 0.010 m 25.0 %" in page.text
    assert "1.0 to 5.0 m 0.150 m 50.0 %" in page.text


def test_stages_licences_and_fingerprints_are_there(page):
    for words in ("61.2 s", "122.2", "Seconds summed over workers", "encode", "f00df00df00df00d", "CC0-1.0", "ab12"):
        assert words in page.text


def test_notes_on_accepted_clips_are_counted(page):
    assert "cloud.missing 6" in page.text


def test_a_sample_is_said_to_be_one(release, made):
    survey = survey_clips(release, made.codec, SurveyConfig(max_clips=2, thumbnails=1, scenes=1))
    page = Page(report_html(ReportData(survey=survey), release))
    assert "fixed sample of 2 of 6 clips" in page.text


def test_missing_sections_say_why(tmp_path, made):
    release = made.release(tmp_path, {"a_d435i/home/000000": "train"}, refusals=(), licences={}, fingerprints={})
    nothing = ClipSurvey(clips_in_release=1, facts=(), thumbnails=(), scenes=())
    text = Page(report_html(ReportData(survey=nothing), release)).text
    assert "quality of the codec was not measured" in text
    assert "without the folder of the run" in text
    assert "every unit that went in is a clip" in text
    assert "No clip is shown" in text
    assert "No scene is shown" in text
    assert "No clip that was read has such a number" in text
    assert "Nothing is held out" in text
    assert "the release states no fingerprints" in text


def test_equal_input_gives_equal_bytes(data, release, made, tmp_path):
    again = ReportData(survey=survey_clips(release, made.codec), stages=STAGES)
    write_report(data, release, tmp_path / "a.html")
    write_report(again, release, tmp_path / "b.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_refused_units_whose_names_are_no_text_are_written_out(tmp_path, made):
    refusal = {"unit": "a_d435i/home\udcff/000001", "reason": "episode.unstorable_name", "message": "rename"}
    release = made.release(tmp_path, {"a_d435i/home/000000": "train"}, refusals=[refusal])
    nothing = ClipSurvey(clips_in_release=1, facts=(), thumbnails=(), scenes=())
    write_report(ReportData(survey=nothing), release, tmp_path / "report.html")
    assert "home\\udcff" in (tmp_path / "report.html").read_text()


def test_the_page_adapts_to_dark_phone_and_print(html):
    for rule in ("prefers-color-scheme: dark", "@media print", "screen and (max-width: 760px)", "width=device-width"):
        assert rule in html


def test_a_release_of_refusals_alone_has_a_report(tmp_path, made):
    release = made.release(tmp_path, {})
    page = Page(report_html(ReportData(survey=survey_clips(release, made.codec)), release))
    assert "0 clips" in page.text
    assert "archive.truncated" in page.text
