import pytest

from wsm_data.errors import ConfigError
from wsm_data.view.browser.refusals import Refusals, named_frame


@pytest.mark.parametrize(
    ("refusal", "frame"),
    [
        ({"details": {"frame": 49, "jumps": 1}}, 49),
        ({"details": {"measured": {"worst_step": [61, 68]}}}, 61),
        ({"details": {"first_frame": 3}, "message": "frame 9"}, 3),
        ({"message": "x: found a jump after frame 12 (1 jumps)"}, 12),
        ({"details": {"frame": "12"}, "message": "between frames"}, None),
        ({}, None),
    ],
)
def test_the_frame_of_a_refusal_is_read_from_its_numbers_or_else_its_message(refusal, frame):
    assert named_frame(refusal) == frame


def test_reasons_are_counted_the_most_frequent_first(made):
    assert Refusals(made.refusals).reasons() == [("path.through_obstacle", 2), ("archive.truncated", 1)]


def test_refusals_are_found_by_reason_and_by_text_and_keep_their_numbers(made):
    refusals = Refusals(made.refusals)
    found = refusals.listed(reason="path.through_obstacle", text="", offset=1, limit=5)
    assert (found["total"], [one["number"] for one in found["refusals"]]) == (2, [2])
    assert refusals.line(2) == made.refusals[2]
    assert refusals.listed(reason="", text="EARLY", offset=0, limit=5)["total"] == 1
    assert refusals.listed(reason="", text="home_0009", offset=0, limit=5)["total"] == 1


def test_what_is_not_there_is_refused(made):
    refusals = Refusals(made.refusals)
    with pytest.raises(ConfigError, match=r"did you mean archive\.truncated"):
        refusals.listed(reason="archive.truncate", text="", offset=0, limit=5)
    with pytest.raises(ConfigError, match="there is no refusal 3; there are 3, from 0"):
        refusals.line(3)
