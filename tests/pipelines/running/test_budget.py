"""How much may be refused: shares of units and of parts, and numbers."""

import pytest

from pipelines.running.budget import RefusalCount, count_refusals, over_budget, with_outcome
from pipelines.running.stage import REFUSED, Outcome
from wsm_data.errors import Reason
from wsm_data.schema.verdict import Refusal

ONE = Refusal(unit="u", source="", reason=Reason.FRAME_EMPTY, message="")
MIXED = [
    Outcome(unit="a", facts={"trajectories": 2}, refusals=(ONE,) * 8),
    Outcome(unit="b", facts={"trajectories": 5}),
    Outcome(unit="c", state=REFUSED, refusals=(ONE,)),
]


def test_units_and_parts_are_counted_apart():
    count = count_refusals(MIXED, 4, "trajectories")
    assert count == RefusalCount(units=1, listed=4, parts=8, found=2 + 8 + 5, part="trajectories")


def test_a_part_that_finish_refuses_was_among_the_kept_ones():
    count = count_refusals(MIXED, 4, "trajectories", [ONE])
    assert (count.parts, count.found) == (9, 15)


def test_counting_one_by_one_gives_what_counting_at_once_gives():
    count = RefusalCount(units=0, listed=4, part="trajectories")
    for outcome in MIXED:
        count = with_outcome(count, outcome)
    whole = count_refusals(MIXED, 4, "trajectories")
    assert (count.units, count.parts) == (whole.units, whole.parts)


@pytest.mark.parametrize(
    ("max_refused", "said"),
    [
        (0.2, "1 of 4 units"),
        (0.25, "8 of 15 trajectories"),
        (0.53, "8 of 15 trajectories"),  # 8 / 15 = 0.533
        (0.54, ""),
        (8, "1 of 4 units and 8 of 15 trajectories"),
        (9, ""),
    ],
)
def test_a_share_is_kept_by_units_and_by_parts_and_a_number_by_their_sum(max_refused, said):
    assert over_budget(max_refused, count_refusals(MIXED, 4, "trajectories")) == said


def test_a_share_of_parts_waits_until_all_parts_are_found_and_a_number_does_not():
    count = RefusalCount(units=0, listed=4, parts=8, part="trajectories")
    assert over_budget(0.5, count) == ""
    assert over_budget(7, count) == "0 of 4 units and 8 trajectories"
