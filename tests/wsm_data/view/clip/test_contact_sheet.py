import dataclasses

import cv2
import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.view.clip.contact_sheet import contact_sheet_figure, draw_contact_sheet, elided
from wsm_data.view.clip.pictures import decode_pictures
from wsm_data.view.drawing.style import figure_style


@pytest.fixture
def figure(clip, made):
    with figure_style():
        yield contact_sheet_figure(clip, decode_pictures(clip, made.codec, range(9)))


def texts_of(figure):
    return [text.get_text() for text in figure.texts]


def test_the_sheet_is_a_picture_1600_pixels_wide_with_something_on_it(clip, made, tmp_path):
    path = tmp_path / "sheet.png"
    draw_contact_sheet(clip, made.codec, path)
    image = cv2.imread(str(path))
    assert image.shape[1] == 1600
    assert 900 < image.shape[0] < 1600
    assert len(np.unique(image.astype(int) @ [1, 256, 65536])) > 200  # colours
    thirds = [part.std() for part in np.array_split(image, 3)]
    assert min(thirds) > 10  # nowhere blank: pictures above, map and curves below


def test_equal_clips_give_equal_bytes(clip, made, tmp_path):
    draw_contact_sheet(clip, made.codec, tmp_path / "a.png")
    draw_contact_sheet(made.clip(), made.codec, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_it_says_which_clip_it_is_and_how_it_was_made(figure, clip):
    texts = texts_of(figure)
    assert texts[0] == clip.meta.key
    for word in ("synthetic", "camera d435i", "codec dct", "9 frames + 4 still", "depth measured", "map from cloud"):
        assert word in texts[1]


def test_every_axis_has_a_unit(figure, made):
    assert made.unlabelled_axes(figure) == []
    labels = {axes.get_ylabel() for axes in figure.axes}
    assert {"geodesic distance (m)", "progress (mm)", "depth (m)", "world y (m)"} <= labels


def test_each_picture_names_its_frame_and_its_measured_share(figure):
    texts = texts_of(figure)
    assert "frame 0, 100 % measured" in texts
    assert "frame 1, 88 % measured" in texts
    assert "frame 8, 100 % measured" in texts


def test_no_text_overlaps_another(figure):
    """Bounding boxes of titles, captions and axis labels; within an axes matplotlib places ticks itself."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    texts = list(figure.texts)
    for axes in figure.axes:
        if axes.axison:
            texts += [axes.xaxis.label, axes.yaxis.label, axes._left_title]
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts if text.get_text()]
    for number, (first, box) in enumerate(boxes):
        assert 0 <= box.x0 < box.x1 <= 1600, first
        for second, other in boxes[number + 1 :]:
            assert not box.overlaps(other), (first, second)


def test_progress_is_the_loss_of_distance_in_millimetres(figure, clip):
    axes = next(axes for axes in figure.axes if axes.get_ylabel() == "progress (mm)")
    bars = [bar for bar in axes.patches if bar.get_width() == 1.0]
    distance_m = clip.expert_distance.astype(np.float64)
    assert [bar.get_height() for bar in bars[:12]] == pytest.approx((distance_m[:-1] - distance_m[1:]) * 1000)
    assert bars[0].get_x() == 0.5  # the first step ends at frame 1


def test_still_frames_are_marked_only_where_there_are_any(figure, made):
    def notes(drawn):
        return [text.get_text() for axes in drawn.axes for text in axes.texts if "still" in text.get_text()]

    assert notes(figure) == ["still (padding)", "still (padding)"]
    clip = made.clip(padded_frames=0)
    with figure_style():
        assert notes(contact_sheet_figure(clip, decode_pictures(clip, made.codec, (0, 12)))) == []


def test_a_long_name_gives_way_in_its_middle(made):
    scene = "stairwell" * 18
    clip = made.clip(f"synth_d435i/{scene}/000003")
    with figure_style():
        title = contact_sheet_figure(clip, decode_pictures(clip, made.codec, (0,))).texts[0].get_text()
    assert title.startswith("synth_d435i/stairwell")
    assert "…" in title
    assert title.endswith("stairwell/000003")


def test_a_clip_of_one_frame_has_a_sheet(made, tmp_path):
    whole = made.clip()
    clip = dataclasses.replace(
        whole,
        meta=dataclasses.replace(whole.meta, frames=1, padded_frames=0),
        rgb_latent=whole.rgb_latent[:1],
        depth_latent=whole.depth_latent[:1],
        depth_valid=whole.depth_valid[:1],
        poses=whole.poses[:1],
        expert_distance=whole.expert_distance[:1],
    )
    draw_contact_sheet(clip, made.codec, tmp_path / "sheet.png")
    assert (tmp_path / "sheet.png").stat().st_size > 10_000


def test_a_clip_of_another_codec_leaves_no_sheet(clip, made, tmp_path):
    other = dataclasses.replace(clip, meta=dataclasses.replace(clip.meta, codec_digest="another"))
    with pytest.raises(ConfigError):
        draw_contact_sheet(other, made.codec, tmp_path / "sheet.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "expected"), [("short", "short"), ("a long scene name", "a lo…name"), ("123456789", "123456789")]
)
def test_long_titles_lose_their_middle(text, expected):
    assert elided(text, 9) == expected
