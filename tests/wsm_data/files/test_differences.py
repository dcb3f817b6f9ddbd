"""Differences of settings: every changed value once, by its full name, with what it was and what it is."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.files.differences import differences

LEAVES = st.none() | st.integers(0, 2) | st.text(max_size=2)
OBJECTS = st.dictionaries(st.sampled_from("abc"), st.recursive(LEAVES, lambda x: st.lists(x, max_size=2), max_leaves=3))


def test_every_setting_that_changed_is_named_with_both_values():
    old = {"a": 1, "grid": {"x": 1, "y": 2}, "gone": None, "word": "red"}
    new = {"a": 1, "grid": {"x": 1, "y": 3}, "new": None, "word": "none"}
    assert differences(old, new) == [
        "gone: null -> absent",
        "grid.y: 2 -> 3",
        "new: absent -> null",
        'word: "red" -> "none"',
    ]


def test_lists_of_objects_are_compared_item_by_item_and_others_as_a_whole():
    old = {"sources": [{"clips": 5, "split": "train"}], "sizes": [1, 2]}
    new = {"sources": [{"clips": 4, "split": "train"}, {"clips": 1}], "sizes": [1]}
    assert differences(old, new) == [
        "sizes: [1, 2] -> [1]",
        "sources[0].clips: 5 -> 4",
        'sources[1]: absent -> {"clips": 1}',
    ]


@pytest.mark.parametrize(("old", "new", "count"), [(1, 1.0, 0), (1, True, 1), (0, False, 1), ("1", 1, 1)])
def test_a_number_is_the_same_however_it_is_written_and_no_flag(old, new, count):
    assert len(differences({"a": old}, {"a": new})) == count


@given(OBJECTS, OBJECTS)
def test_there_are_none_just_where_the_objects_are_equal(old, new):
    assert (differences(old, new) == []) == (old == new)
