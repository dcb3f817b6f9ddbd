import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.view.drawing.style import figure_style
from wsm_data.view.selection.charts import compared_histogram, difficulty_chart, leading_chart, shared_edges


@pytest.fixture(autouse=True)
def style():
    with figure_style():
        yield


def stairs(figure):
    """Heights of the filled distribution of all, and of the line of the chosen."""
    everything, chosen = figure.axes[0].patches
    return everything.get_data().values, chosen.get_data().values


def test_both_distributions_sum_to_all_of_their_clips():
    rng = np.random.default_rng(0)
    figure = compared_histogram(rng.uniform(size=1000), rng.uniform(0.8, 0.9, 100), "detour (ratio)", share=False)
    everything, chosen = stairs(figure)
    assert everything.sum() == pytest.approx(0.995, abs=2e-3)  # the axis ends where 99.5 % do
    assert chosen.sum() == pytest.approx(1)
    assert figure.axes[0].get_xlabel() == "detour (ratio)"


def test_what_lies_beyond_the_axis_is_said_of_both():
    everything = np.concatenate([np.linspace(0, 1, 998), [50, 60]])
    figure = compared_histogram(everything, np.array([0.9, 50.0]), "x", share=False)
    text = figure.axes[0].get_title(loc="right")
    assert text.startswith("beyond: 0.")
    assert text.endswith("50 % of chosen")


def test_where_no_chosen_clip_has_the_score_only_the_share_of_all_is_said():
    figure = compared_histogram(np.concatenate([np.linspace(0, 1, 998), [50, 60]]), np.empty(0), "x", share=False)
    assert figure.axes[0].get_title(loc="right") == "beyond: 0.4 % of all"


def test_few_clips_are_all_on_the_axis():
    figure = compared_histogram(np.arange(10.0), np.array([9.0]), "x", share=True)
    assert figure.axes[0].get_title(loc="right") == ""
    assert stairs(figure)[0].sum() == pytest.approx(1)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50))
def test_edges_rise_and_hold_the_values(values):
    numbers = np.array(values)
    edges = shared_edges(numbers)
    assert (np.diff(edges) > 0).all() or np.ptp(numbers) < 1e-6  # a spread below rounding has no edges between
    assert edges[0] <= numbers.min()
    assert (numbers <= edges[-1]).mean() >= 0.99


def test_difficulty_is_drawn_for_candidates_and_chosen():
    everything, chosen = stairs(difficulty_chart(np.linspace(0, 1, 100), np.linspace(0.9, 1, 10)))
    assert np.flatnonzero(chosen)[0] > len(everything) / 2


def test_bars_carry_their_counts_and_shares():
    figure = leading_chart(["detour", "dead end"], [30, 10])
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.texts] == ["30 (75 %)", "10 (25 %)"]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["detour", "dead end"]


def test_every_axis_names_its_unit(made):
    figures = [compared_histogram(np.arange(9.0), np.arange(3.0), "x (m)", share=False), leading_chart(["a"], [1])]
    assert [label for figure in figures for label in made.unlabelled_axes(figure)] == []
