"""wsm dream: the sheet of one clip, as training draws it."""

import cv2
import numpy as np
import pytest

from pipelines.operations.models import dream_film
from pipelines.training import pictures
from wsm_data.access.release import open_release
from wsm_data.view.clip.facts import world_path_m


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


def test_a_film_shows_the_dream_beside_the_truth_and_both_ways(wsm, trained, key, tmp_path, monkeypatch):
    frames, real = [], dream_film.write_film
    monkeypatch.setattr(
        dream_film,
        "write_film",
        lambda path, grid, goal, them: real(path, grid, goal, iter(frames.extend(them) or frames)),
    )
    path = tmp_path / "a.mp4"
    code, text = wsm("dream", trained.model, trained.release, key, *trained.likewise, "--out", path)
    assert code == 0, text
    assert int(cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT)) == len(frames) == 13  # 1 + 4 seen, 8 dreamed
    assert [frame.beside_u8 is None for frame in frames] == [True] * 5 + [False] * 8
    release = open_release(trained.release)
    decoded = release.decode(key, frames=range(13))
    error = np.abs(np.stack([frame.seen_u8 for frame in frames]).astype(int) - decoded.rgb)
    assert error.max() <= 1  # the standard is taken off and put on in float32
    way_m = world_path_m(release[key])[:13, :2]
    np.testing.assert_allclose(frames[-1].true_m, way_m)
    np.testing.assert_allclose(frames[-1].estimated_m[0], way_m[0], atol=1e-9)  # the first camera is given


def test_a_dream_is_of_a_clip_of_the_model_s_latents_and_goes_to_a_picture(
    wsm, trained, of_other_latents, key, tmp_path
):
    for model, clip, name, said in (
        (trained.model, "no/such/clip", "a.png", "no clip 'no/such/clip'"),
        (trained.model, key, "a.jpg", "must name a PNG or an MP4"),
        (of_other_latents, key, "a.png", "differ in codec_digest"),
    ):
        code, text = wsm("dream", model, trained.release, clip, "--out", tmp_path / name)
        assert code == 2
        assert said in text
        assert not (tmp_path / name).exists()
