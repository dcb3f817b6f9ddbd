import matplotlib
import numpy as np
import pytest

from wsm_data.view.drawing.style import INK, figure_png, figure_style, new_figure, picture_png


def png_size(data: bytes) -> tuple[int, int]:
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def test_a_users_settings_do_not_reach_a_figure_and_are_back_afterwards():
    with matplotlib.rc_context({"font.size": 31.0, "text.color": "red"}):
        with figure_style():
            assert matplotlib.rcParams["font.size"] == 11
            assert matplotlib.rcParams["text.color"] == INK
        assert matplotlib.rcParams["font.size"] == 31.0
        assert matplotlib.rcParams["text.color"] == "red"


def test_settings_are_back_after_an_error():
    with matplotlib.rc_context({"font.size": 31.0}):
        with pytest.raises(KeyError), figure_style():
            raise KeyError
        assert matplotlib.rcParams["font.size"] == 31.0


def test_a_figure_has_the_pixels_that_were_asked_for():
    with figure_style():
        assert png_size(figure_png(new_figure(417, 233))) == (417, 233)


def test_a_dollar_sign_in_a_text_is_a_dollar_sign():
    with figure_style():
        figure = new_figure(200, 100)
        figure.text(0.1, 0.5, r"$\no{such} formula$")  # parsed as a formula it raises
        assert len(figure_png(figure)) > 500


def test_a_picture_keeps_its_size_and_equal_pictures_have_equal_bytes():
    picture = np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3)
    assert png_size(picture_png(picture)) == (7, 5)
    assert picture_png(picture) == picture_png(picture.copy())
    assert b"matplotlib" not in picture_png(picture).lower()
