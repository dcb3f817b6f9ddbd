import pytest

from wsm_data.view.drawing.text_table import aligned, bytes_text, printable


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "0 bytes"),
        (999, "999 bytes"),
        (1000, "1.00 kB"),
        (30_441_000, "30.4 MB"),
        (512 << 20, "537 MB"),
        (999_500, "1.00 MB"),
        (999_499, "999 kB"),
        (1_050_000_000_000, "1.05 TB"),
        (5 * 10**18, "5000 PB"),
    ],
)
def test_bytes_have_three_digits(count, text):
    assert bytes_text(count) == text


def test_columns_line_up_and_lines_end_without_blanks():
    text = aligned([("name", "clips"), ("a", "7"), ("longer name", "1,234")], right=(1,))
    assert text.splitlines() == ["name         clips", "a                7", "longer name  1,234"]


def test_what_is_no_character_is_spelled_out():
    assert printable("scene\udcff") == "scene\\udcff"
    assert printable("Küche 部屋") == "Küche 部屋"
