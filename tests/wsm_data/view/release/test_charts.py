import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.codecs.quality import DepthErrors
from wsm_data.view.drawing.style import figure_style
from wsm_data.view.release.charts import bin_edges, depth_error_chart, histogram, stage_chart
from wsm_data.view.release.distributions import Distribution
from wsm_data.view.release.report_data import StageSummary


def distribution(*values, share=False, finest=0.1):
    return Distribution(title="Path length", label="length (m)", finest=finest, values=values, share=share)


def stage(name="encode", seconds=2.0, done=7):
    return StageSummary(
        name=name, version=1, units=9, done=done, refused=2, seconds=2 * seconds, wall_seconds=seconds, workers=2
    )


def test_a_histogram_counts_every_value_once_and_names_the_median(made):
    with figure_style():
        figure = histogram(distribution(1.0, 2.0, 2.05, 9.0, 30.0))
    axes = figure.axes[0]
    assert sum(bar.get_height() for bar in axes.patches) == 5
    assert axes.get_title(loc="right") == "median 2.05"
    assert made.unlabelled_axes(figure) == []


@pytest.mark.parametrize("values", [(0.0,), (7.0427, 7.0428), (1.0, 1.0)])
def test_values_that_hardly_differ_do_not_look_like_a_spread(values):
    with figure_style():
        axes = histogram(distribution(*values)).axes[0]
    low, high = axes.get_xlim()
    assert sum(bar.get_height() > 0 for bar in axes.patches) == 1
    assert high - low >= 6 * 0.1


def test_shares_are_written_as_percentages_and_end_near_one_hundred():
    with figure_style():
        axes = histogram(distribution(0.98, 1.0, share=True, finest=0.005)).axes[0]
    assert axes.get_title(loc="right") == "median 99.0%"
    assert axes.get_xlim()[1] <= 1.005
    assert axes.xaxis.get_major_formatter()(0.985) == "98.5%"


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50),
    st.sampled_from([0.005, 0.01, 0.1, 1.0]),
)
def test_bins_hold_every_value_and_are_few_and_equal(values, finest):
    numbers = np.array(values)
    edges = bin_edges(numbers, finest)
    assert edges[0] <= numbers.min()
    assert numbers.max() <= edges[-1]
    assert 2 <= len(edges) <= 26
    assert np.histogram(numbers, edges)[0].sum() == len(numbers)
    assert np.diff(edges) == pytest.approx(np.full(len(edges) - 1, edges[1] - edges[0]), rel=1e-4)


def test_values_on_an_edge_stand_in_the_bin_they_open():
    numbers = np.arange(10) * 0.1  # 0.3 is not a multiple of 0.1 in binary
    assert np.histogram(numbers, bin_edges(numbers, 0.1))[0].tolist() == [1] * 10


def test_depth_errors_are_bars_over_the_true_depth(made):
    errors = DepthErrors(edges_m=(0.2, 1.0, 3.0, 5.0), error_sum_m=(1.0, 0.0, 8.0), counts=(10, 0, 20), pixels=40)
    with figure_style():
        figure = depth_error_chart(errors)
    bars = figure.axes[0].patches
    assert [bar.get_x() for bar in bars] == [0.2, 1.0, 3.0]
    assert bars[0].get_height() == pytest.approx(0.1)
    assert np.isnan(bars[1].get_height())  # no pixel lies there: no bar, not a bar of zero
    assert bars[2].get_height() == pytest.approx(0.4)
    assert made.unlabelled_axes(figure) == []


def test_stages_stand_in_the_order_of_the_flow_with_time_and_rate(made):
    with figure_style():
        figure = stage_chart([stage("index", 4.0), stage("encode", 2.0, done=7), stage("split", 0.0)])
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["index", "encode", "split"]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first stage is on top
    assert [text.get_text() for text in axes.texts] == ["4.0 s, 1.75 units per s", "2.0 s, 3.5 units per s", "0.0 s"]
    assert made.unlabelled_axes(figure) == []


def charts():
    errors = DepthErrors(edges_m=(0.2, 1.0, 5.0), error_sum_m=(1.25, 8.5), counts=(10, 20), pixels=40)
    yield histogram(distribution(*np.linspace(100.5, 12345.25, 40)))
    yield histogram(distribution(*[0.01] * 20_000, share=True))
    yield depth_error_chart(errors)
    yield stage_chart([stage("encode"), stage("a_stage_of_a_long_name", 61234.5)])


def test_nothing_is_cut_off_and_no_label_covers_a_tick():
    with figure_style():
        for figure in charts():
            figure.canvas.draw()
            renderer, axes = figure.canvas.get_renderer(), figure.axes[0]
            for axis in (axes.xaxis, axes.yaxis):
                label = axis.label.get_window_extent(renderer)
                assert label.x0 >= 0
                assert label.y0 >= 0
                assert label.x1 <= figure.bbox.width
                assert label.y1 <= figure.bbox.height
                ticks = [tick for tick in axis.get_ticklabels() if tick.get_text()]
                assert not any(label.overlaps(tick.get_window_extent(renderer)) for tick in ticks)
