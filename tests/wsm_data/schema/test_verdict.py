"""Verdicts and refusals: values that can always be written down."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.verdict import Refusal, Verdict

JSON_SCALARS = [None, True, 3, 2.5, "text", Reason.POSE_JUMP]
NUMPY_VALUES = [np.float32(0.5), np.int64(7), np.bool_(True), np.arange(3), np.array([1.0, np.inf])]
WITHOUT_JSON = [float("nan"), float("-inf"), Path("scene/a.jpg"), (1, 2), b"bytes", {1, 2}]
ODD_VALUES = st.sampled_from([*JSON_SCALARS, *NUMPY_VALUES, *WITHOUT_JSON])


def refusal(details):
    return Refusal(unit="g/s/e", source="g/s.tar.gz", reason=Reason.POSE_JUMP, message="m", details=details)


def test_a_verdict_without_a_reason_keeps_the_record():
    assert Verdict(measured={"largest_step_m": 0.04}).keep


def test_a_verdict_with_a_reason_refuses_it():
    verdict = Verdict(reason=Reason.POSE_JUMP, message="the camera jumps", measured={"largest_step_m": 3.2})
    assert not verdict.keep
    assert verdict.measured == {"largest_step_m": 3.2}


def test_a_refusal_says_what_the_error_said():
    error = DataError(Reason.FRAME_EMPTY, "frame 17 is empty", {"frame": 17})
    assert Refusal.from_error("g/s/e", "g/s.tar.gz", error) == Refusal(
        unit="g/s/e", source="g/s.tar.gz", reason=Reason.FRAME_EMPTY, message="frame 17 is empty", details={"frame": 17}
    )


@given(st.dictionaries(st.text() | st.integers(), ODD_VALUES | st.lists(ODD_VALUES)))
def test_whatever_was_measured_can_be_written_down(details):
    canonical_json(refusal(details).details)
    canonical_json(Verdict(measured=details).measured)


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (np.float64(0.25), 0.25),
        (np.int64(7), 7),
        (np.array([[1, 2], [3, 4]]), [[1, 2], [3, 4]]),
        ((1, 2.5, None), [1, 2.5, None]),
        (float("nan"), "nan"),
        (np.array([1.0, np.inf]), [1.0, "inf"]),
        (Path("scene/a.jpg"), "scene/a.jpg"),
        ({"inner": (np.int32(1),)}, {"inner": [1]}),
        (True, True),
    ],
)
def test_details_become_the_nearest_json_value(value, written):
    assert refusal({"value": value}).details == {"value": written}
    assert type(refusal({"value": value}).details["value"]) is type(written)
