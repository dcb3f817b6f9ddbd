import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.association import associate

stamps = st.lists(st.integers(0, 400), min_size=1, max_size=30, unique=True).map(lambda x: np.array(sorted(x)) / 256)


@given(stamps, stamps)
def test_pairs_are_those_that_trying_all_finds(a, b):
    short, long = (a, b) if len(a) <= len(b) else (b, a)
    wanted = [
        (i, int(np.argmin(np.abs(long - stamp)))) for i, stamp in enumerate(short) if np.abs(long - stamp).min() <= 0.01
    ]
    if not wanted:
        with pytest.raises(DataError) as refusal:
            associate(a, b)
        assert refusal.value.reason == Reason.TRAJECTORY_UNMATCHED
        return
    of_a, of_b = associate(a, b)
    of_short, of_long = (of_a, of_b) if len(a) <= len(b) else (of_b, of_a)
    assert list(zip(of_short.tolist(), of_long.tolist(), strict=True)) == wanted


def test_keyframes_find_their_frames():
    of_a, of_b = associate(np.array([0.0, 0.9, 2.1]), np.arange(30) * 0.1)
    assert of_a.tolist() == [0, 1, 2]
    assert of_b.tolist() == [0, 9, 21]


def test_stamps_that_do_not_rise_are_a_mistake_of_the_caller():
    with pytest.raises(ValueError, match="stamps_b_s must rise"):
        associate(np.array([0.0]), np.array([1.0, 1.0]))
