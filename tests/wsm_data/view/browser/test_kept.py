from concurrent.futures import ThreadPoolExecutor

import pytest

from wsm_data.view.browser.kept import Kept


def test_the_last_ones_that_were_asked_for_are_kept():
    made = []
    kept = Kept(lambda key: made.append(key) or key.upper(), 2)
    assert [kept.get(key) for key in "abacab"] == list("ABACAB")
    assert made == ["a", "b", "c", "b"]  # b was asked for longest ago when c came


def test_many_threads_make_a_thing_once():
    made = []
    kept = Kept(lambda key: made.append(key) or key, 4)
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(kept.get, ["a"] * 64)) == ["a"] * 64
    assert made == ["a"]


def test_what_could_not_be_made_is_tried_again():
    answers = iter([ValueError("first"), "second"])

    def make(key):
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    kept = Kept(make, 1)
    with pytest.raises(ValueError, match="first"):
        kept.get("a")
    assert kept.get("a") == "second"
