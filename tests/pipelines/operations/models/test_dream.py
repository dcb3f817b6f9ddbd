"""wsm dream: the sheet of one clip, as training draws it."""

import cv2
import pytest

from pipelines.training import pictures
from wsm_data.access.release import open_release


@pytest.fixture
def sheets(monkeypatch):
    """The sheets that are drawn, in their order."""
    drawn, real = [], pictures.draw_dream_sheet
    monkeypatch.setattr(pictures, "draw_dream_sheet", lambda sheet, path: (drawn.append(sheet), real(sheet, path)))
    return drawn


@pytest.fixture
def key(trained) -> str:
    """A clip in the middle of the index."""
    keys = open_release(trained.release).keys()
    return keys[len(keys) // 2]


def test_the_clip_that_is_named_is_seen_and_dreamed(wsm, trained, key, sheets, tmp_path):
    words = ("dream", trained.model, trained.release, key, *trained.likewise)
    for name in ("a.png", "b.png"):
        code, text = wsm(*words, "--out", tmp_path / name)
        assert code == 0, text
    assert sheets[0].title == f"after step 1: {key}, 5 frames seen, 8 dreamed"  # of 5 latents: 2 seen, a chunk of 2
    start, end = sheets[0].true_path_m[0], sheets[0].true_path_m[-1]
    meta = open_release(trained.release)[key].meta
    assert len(sheets[0].true_path_m) == 13 <= meta.frames
    assert (start == 0).all()
    assert (end != 0).any()
    assert cv2.imread(str(tmp_path / "a.png")).std() > 1
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_dream_is_of_a_clip_of_the_model_s_latents_and_goes_to_a_png(wsm, trained, of_other_latents, key, tmp_path):
    for model, clip, name, said in (
        (trained.model, "no/such/clip", "a.png", "no clip 'no/such/clip'"),
        (trained.model, key, "a.jpg", "must be the PNG"),
        (of_other_latents, key, "a.png", "differ in codec_digest"),
    ):
        code, text = wsm("dream", model, trained.release, clip, "--out", tmp_path / name)
        assert code == 2
        assert said in text
        assert not (tmp_path / name).exists()
