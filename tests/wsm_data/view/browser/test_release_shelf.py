from types import SimpleNamespace

import numpy as np
import pytest
import simplejpeg

from wsm_data.errors import ConfigError
from wsm_data.view.browser.clip_query import ClipQuery
from wsm_data.view.browser.release_shelf import ReleaseShelf

KEY = "synth_d435i/home_0001/000000"


@pytest.fixture
def shelf(release) -> ReleaseShelf:
    return ReleaseShelf(release)


def test_nothing_is_read_of_a_clip_before_it_is_looked_at(release, monkeypatch):
    def refuse(*_):
        raise AssertionError("a clip was read")

    monkeypatch.setattr(type(release), "read_row", refuse)
    shelf = ReleaseShelf(release)
    assert shelf.about()["clips"] == shelf.clips(ClipQuery())["total"] == 6
    with pytest.raises(AssertionError, match="a clip was read"):
        shelf.thumbnail(KEY)


def test_a_page_of_clips_says_how_many_there_are(shelf):
    found = shelf.clips(ClipQuery(offset=4, limit=1, words={"split": "train"}))
    assert (found["total"], found["clips"]) == (3, [])
    found = shelf.clips(ClipQuery(offset=1, limit=1, words={"split": "train"}))
    assert [clip["key"] for clip in found["clips"]] == [KEY]  # % of the hostile scene sorts before _


def test_the_clips_of_a_selection_have_rank_and_reason(selected):
    shelf = ReleaseShelf(selected.release)
    assert "hard" in shelf.about()["selections"]
    found = shelf.clips(ClipQuery(selection="hard", sort="rank"))
    hard = selected.release.selection("hard")
    assert [(clip["key"], clip["rank"], clip["why"]) for clip in found["clips"]] == list(
        zip(hard.keys.to_pylist(), hard.ranks.tolist(), hard.why.to_pylist(), strict=True)
    )


def test_the_neighbours_of_a_clip_are_those_of_the_list_it_stands_in(shelf):
    tests = ClipQuery(words={"split": "test"})
    keys = [clip["key"] for clip in shelf.clips(tests)["clips"]]
    assert shelf.around(keys[1], tests) == {"place": 1, "total": 3, "previous": keys[0], "next": keys[2]}
    assert shelf.around(keys[0], tests)["previous"] is None
    assert shelf.around(KEY, tests) == {"place": None, "total": 3, "previous": None, "next": None}


def test_a_frame_is_what_the_release_decodes(shelf, release):
    decoded = release.decode(KEY)
    picture = simplejpeg.decode_jpeg(shelf.frame(KEY, "rgb", 5))
    assert np.abs(picture.astype(int) - decoded.rgb[5]).mean() < 2  # JPEG at quality 88
    assert simplejpeg.decode_jpeg(shelf.frame(KEY, "depth", 8)).shape == picture.shape
    assert simplejpeg.decode_jpeg(shelf.thumbnail(KEY)).shape == picture.shape


@pytest.mark.parametrize(("kind", "number"), [("rgb", 9), ("map", 0)])  # 9 of 13 frames were recorded
def test_a_frame_that_is_not_there_is_refused(shelf, kind, number):
    with pytest.raises(ConfigError, match=f"no {kind} frame {number}"):
        shelf.frame(KEY, kind, number)


def test_a_clip_that_is_not_there_is_refused(shelf):
    for ask in (shelf.page, shelf.thumbnail, shelf.map_png):
        with pytest.raises(ConfigError, match=r"no clip '\.\./\.\./etc/passwd'"):
            ask("../../etc/passwd")


def test_the_page_of_a_clip_has_its_scores_with_what_they_mean(selected):
    shelf = ReleaseShelf(selected.release)
    page = shelf.page(KEY)
    assert [one["name"] for one in page["scores"]] == ["detour_ratio", "clearance_least_m", "retreat_m"]
    assert page["texts"]["physical_scene"] == "synth/home_0001"


def test_warming_up_decodes_once_and_reads_no_clip(shelf, release, monkeypatch):
    decoded = []
    codec = SimpleNamespace(decode=lambda latents: decoded.append(latents.shape))
    monkeypatch.setattr(type(release), "read_row", None)
    monkeypatch.setattr(type(release), "codec", lambda *_: codec)
    shelf.warm_up()
    shelf.warm_up()
    assert decoded == [(2, 48, 2, 4)]  # two latents of 64 x 32 px
