"""Plans as answers, and answers of other planners as plans."""

import json

import numpy as np
import pytest

from wsm_data.planners.http.answer import decode_answer, encode_answer
from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.planner import Plan

SHORT = Plan(path_m=np.array([[0.0, 0.0], [1.0, 0.5]]))
LONG = Plan(
    path_m=np.array([[0.0, 0.0, 0.1], [1.0, 0.0, 0.2], [2.0, 0.0, 0.3]]),
    candidates_m=np.zeros((2, 3, 3)),
    values=np.array([0.5, -1.0]),
)


def test_numbers_are_rectangular_and_a_short_path_stays_at_its_end():
    record = json.loads(encode_answer([SHORT, LONG], None))
    assert record["trajectory"][0] == [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0], [1.0, 0.5, 0.0]]
    assert np.shape(record["all_trajectory"]) == (2, 2, 3, 3)
    assert record["all_values"] == [[0.0, 0.0], [0.5, -1.0]]


def test_one_key_more_or_less_tells_clients_of_start_goals_from_those_of_point_goals():
    point = json.loads(encode_answer([SHORT], None))
    start = json.loads(encode_answer([SHORT], np.array([[1.0, 2.0, 0.0]])))
    assert set(point) == {"trajectory", "all_trajectory", "all_values"}
    assert set(start) - set(point) == {"sub_pointgoal_pd"}
    assert start["sub_pointgoal_pd"] == [[1.0, 2.0, 0.0]]


def test_an_answer_comes_back_exactly():
    (back,) = decode_answer(encode_answer([LONG], np.array([[0.1 + 0.2, 2.0, 0.0]])), 1)
    np.testing.assert_array_equal(back.path_m, LONG.path_m)
    np.testing.assert_array_equal(back.candidates_m, LONG.candidates_m)
    np.testing.assert_array_equal(back.values, LONG.values)
    np.testing.assert_array_equal(back.goal_estimate_m, [0.30000000000000004, 2.0, 0.0])


def test_candidates_of_another_shape_are_left_out():
    path = [[0, 0, 0], [1, 0, 0]]
    text = json.dumps({"trajectory": [path, path], "all_trajectory": [[path, path]], "all_values": [[0], [0]]}).encode()
    assert [plan.candidates_m for plan in decode_answer(text, 2)] == [None, None]


@pytest.mark.parametrize(
    ("text", "batch", "fault"),
    [
        (b"<html>", 1, Fault.MALFORMED),
        (b"{}", 1, Fault.MALFORMED),
        (b'{"trajectory": [[[0, 0], [NaN, 0]]]}', 1, Fault.NOT_FINITE),
        (b'{"trajectory": [[[0, 0], [1, 0]]]}', 4, Fault.WRONG_BATCH),
        (b'{"trajectory": [[[0, 0]]]}', 1, Fault.MALFORMED),
        (b'{"trajectory": [[[0], [1]]]}', 1, Fault.MALFORMED),
        (b'{"trajectory": [[0, 0], [1, 0]]}', 2, Fault.MALFORMED),
        (b'{"trajectory": [[[0, 0], [1, 0]]], "sub_pointgoal_pd": [[1, 2]]}', 1, Fault.MALFORMED),
        (b"\xff\xfe", 1, Fault.MALFORMED),
    ],
)
def test_answers_of_no_use_are_named(text, batch, fault):
    with pytest.raises(WireError) as refused:
        decode_answer(text, batch)
    assert refused.value.fault is fault
