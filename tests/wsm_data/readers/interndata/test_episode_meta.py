import pytest

from wsm_data.readers.interndata.episode_meta import read_image_spans, read_lengths
from wsm_data.readers.interndata.naming import ImageSpan


def test_lengths_are_found_by_episode_index_or_by_line():
    assert read_lengths(memoryview(b'{"episode_index": 4, "length": 9}\n\n{"length": 8}\n')) == {4: 9, 1: 8}


@pytest.mark.parametrize(
    "line",
    [
        b'{"image_index": {"min": 3, "max": 7}}',
        b'{"image_index": {"min": [3], "max": [7], "count": [5]}}',
        b'{"episode_index": 0, "stats": {"image_index": {"min": [3.0], "max": [7.0]}}}',
    ],
)
def test_image_spans_are_found_in_every_spelling(line):
    assert read_image_spans(memoryview(line)) == {0: ImageSpan(3, 7)}


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xfe",
        b"[1]\nnull\n{",
        b'{"length": "9"}',
        b'{"image_index": 3}',
        b'{"image_index": {"min": 3, "max": 2}}',
    ],
)
def test_what_cannot_be_read_says_nothing(data):
    assert read_lengths(memoryview(data)) == {}
    assert read_image_spans(memoryview(data)) == {}


def test_a_bad_line_does_not_shift_the_others():
    assert read_lengths(memoryview(b'{"length": 5}\nbroken\n{"length": 7}\n')) == {0: 5, 2: 7}
