import re
from html.parser import HTMLParser

import pytest

from wsm_data.view.drawing.style import BAR, INK, figure_style, new_figure
from wsm_data.view.drawing.svg import THEMED, figure_svg


@pytest.fixture
def drawn():
    def draw(name="chart-1", text="a < b & c", description="what it shows"):
        with figure_style():
            figure = new_figure(300, 200)
            axes = figure.add_subplot()
            axes.bar([1, 2], [3, 4], color=BAR, hatch="//")
            axes.imshow([[1, 2], [3, 4]])
            axes.set_title(text)
            return figure_svg(figure, name, description)

    return draw


class Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.ids, self.references, self.text = [], [], [], ""

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self._note(attrs)

    def handle_startendtag(self, tag, attrs):
        self._note(attrs)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def _note(self, attrs):
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name == "href" and value.startswith("#"):
                self.references.append(value[1:])
            self.references += re.findall(r"url\(#([^)]*)\)", value or "")


def test_it_is_one_balanced_element_that_loads_nothing(drawn):
    svg = drawn()
    tags = Tags()
    tags.feed(svg)
    assert svg.startswith("<svg viewBox=")
    assert tags.open == []
    assert "http" not in svg
    assert "xmlns" not in svg
    assert "<style" not in svg


def test_every_reference_has_its_target_and_every_id_the_figures_name(drawn):
    tags = Tags()
    tags.feed(drawn("chart-7"))
    assert tags.references
    assert set(tags.references) == set(tags.ids)
    assert len(set(tags.ids)) == len(tags.ids)
    assert all(one.startswith("chart-7-") for one in tags.ids)


def test_two_figures_of_a_page_share_no_id(drawn):
    first, second = Tags(), Tags()
    first.feed(drawn("chart-1"))
    second.feed(drawn("chart-2"))
    assert not set(first.ids) & set(second.ids)


def test_colours_of_text_and_bars_follow_the_page(drawn):
    svg = drawn()
    assert "var(--ink)" in svg
    assert "var(--bar)" in svg
    assert INK not in svg
    assert not [colour for colour in THEMED if colour in svg]


def test_text_stays_text_in_the_pages_font(drawn):
    tags = Tags()
    svg = drawn(text="clips <b>bold</b> & more")
    tags.feed(svg)
    assert "clips <b>bold</b> & more" in tags.text
    assert "<b>" not in svg
    assert "DejaVu" not in svg
    assert "var(--font)" in svg


def test_the_description_cannot_leave_its_attribute(drawn):
    svg = drawn(description='map of "x" onload="alert(1)" <b>')
    assert 'onload="' not in svg
    assert "&quot;x&quot;" in svg


def test_equal_figures_have_equal_bytes(drawn):
    assert drawn() == drawn()
