import numpy as np
import pytest

from wsm_data.metrics.bootstrap import estimate_over_scenes


def test_scenes_count_alike_however_many_episodes_they_have():
    found = estimate_over_scenes(np.array([1.0, 1.0, 1.0, 0.0]), ["a", "a", "a", "b"], seed=0)
    assert found.value == 0.5


def test_the_interval_is_that_of_the_normal_law_for_many_scenes():
    rng = np.random.default_rng(0)
    values = rng.normal(size=400)
    found = estimate_over_scenes(values, [str(i) for i in range(400)], seed=1)
    half = 1.96 * values.std() / 20  # standard error of a mean of 400
    assert found.low == pytest.approx(found.value - half, abs=0.1 * half)
    assert found.high == pytest.approx(found.value + half, abs=0.1 * half)


def test_episodes_of_one_scene_widen_nothing_when_they_agree():
    found = estimate_over_scenes(np.tile([1.0, 0.0], 50), ["a"] * 50 + ["b"] * 50, seed=0)
    assert (found.low, found.high) == (0.5, 0.5)
    assert found.resampled == "scenes"


def test_with_one_scene_its_episodes_are_drawn_and_the_estimate_says_so():
    found = estimate_over_scenes(np.tile([1.0, 0.0], 50), ["a"] * 100, seed=0)
    assert found.resampled == "episodes"
    assert found.low < 0.45 < 0.55 < found.high


def test_the_same_seed_draws_the_same():
    values, scenes = np.arange(9.0), list("aaabbbccc")
    assert estimate_over_scenes(values, scenes, 3) == estimate_over_scenes(values, scenes, 3)


@pytest.mark.parametrize("values", [[], [np.nan]])
def test_nothing_and_what_is_not_finite_have_no_mean(values):
    with pytest.raises(ValueError, match="must be finite"):
        estimate_over_scenes(np.array(values), ["a"] * len(values), 0)
