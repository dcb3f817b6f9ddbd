import base64

import cv2
import numpy as np
import pytest
from jinja2 import UndefinedError
from matplotlib.figure import Figure

from wsm_data.view.drawing.page import data_url, inline_svg, page_template
from wsm_data.view.drawing.style import figure_style


def test_a_template_escapes_what_it_is_given_and_knows_bytes():
    template = page_template("selection.html.j2").environment.from_string("{{ text }} {{ 2048 | bytes }}")
    assert template.render(text="<b>") == "&lt;b&gt; 2.05 kB"


def test_a_name_that_is_not_given_is_an_error():
    with pytest.raises(UndefinedError):
        page_template("selection.html.j2").render()


def test_a_figure_is_markup_whose_description_is_escaped():
    with figure_style():
        markup = inline_svg(Figure(), "name", 'a "quoted" <word>')
    assert markup.startswith("<svg")
    assert markup == markup.__html__()
    assert "<word>" not in markup


def test_a_picture_is_its_own_address():
    picture_u8 = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    kind, content = data_url(picture_u8).split(",")
    assert kind == "data:image/png;base64"
    bgr = cv2.imdecode(np.frombuffer(base64.b64decode(content), np.uint8), cv2.IMREAD_COLOR)
    assert (bgr[..., ::-1] == picture_u8).all()
