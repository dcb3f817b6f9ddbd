"""The charts of the report, each a figure of its own with units on both axes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, ScalarFormatter

from wsm_data.codecs.quality import DepthErrors
from wsm_data.schema.arrays import Float64Array
from wsm_data.view.drawing.style import BAR, BAR_SECOND, INK, MUTED, new_figure
from wsm_data.view.release.distributions import Distribution
from wsm_data.view.release.report_data import StageSummary

_WIDTH_PX, _HEIGHT_PX = 370, 236
_BROAD_PX = 860
_MAX_BINS = 24


def histogram(shown: Distribution) -> Figure:
    """Distribution of a number over clips, with its median; call within `figure_style()`.

    Args:
        shown: at least one value.
    """
    numbers = np.asarray(shown.values, np.float64)
    figure, axes = _chart()
    edges = bin_edges(numbers, shown.finest)
    axes.hist(numbers, bins=edges.tolist(), color=BAR, edgecolor="none", rwidth=0.92)
    median = float(np.median(numbers))
    axes.axvline(median, color=BAR_SECOND, lw=2)
    written = f"{median:.1%}" if shown.share else f"{median:.4g}"
    axes.set_title(f"median {written}", loc="right", fontsize=10, fontweight="normal", color=MUTED)
    axes.set(xlabel=shown.label, ylabel="clips (count)", xlim=_limits(edges, shown.share))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5))
    axes.xaxis.set_major_formatter(FuncFormatter(_percent) if shown.share else ScalarFormatter(useOffset=False))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
    axes.grid(axis="y")
    return figure


def bin_edges(numbers: Float64Array, finest: float) -> Float64Array:
    """Edges of equal bins at round numbers: the narrowest of 1, 2, 5, 10, ... times `finest` that needs at most 24."""
    low, high = float(numbers.min()), float(numbers.max())
    scales = (finest * factor * 10.0**power for power in range(300) for factor in (1, 2, 5))
    width = next(width for width in scales if (high - low) / width <= _MAX_BINS)
    # Half a millionth of a bin is given way, so that a value on an edge is not pushed off it by rounding.
    first, last = np.floor(low / width + 5e-7), np.floor(high / width + 5e-7) + 1
    return np.arange(first, last + 1) * width - 5e-7 * width


def _percent(share: float, _position: int | None = None) -> str:
    return f"{100 * share:.4g}%"


def _limits(edges: Float64Array, share: bool) -> tuple[float, float]:
    """Limits that show at least twelve bins, so that few bins do not look like a spread, and no impossible numbers."""
    width = edges[1] - edges[0]
    missing = max(0.0, 12 - (len(edges) - 1)) / 2 * width
    low, high = float(edges[0] - missing), float(edges[-1] + missing)
    if edges[0] > -width:
        low = max(low, min(0.0, float(edges[0])))
    return (low, min(high, 1.0 + width)) if share else (low, high)


def depth_error_chart(errors: DepthErrors) -> Figure:
    """Mean absolute error of decoded depth over the true depth; call within `figure_style()`."""
    figure, axes = _chart()
    edges = np.array(errors.edges_m)
    means = np.array([np.nan if mean is None else mean for mean in errors.mean_error_m])
    axes.bar(edges[:-1], means, width=np.diff(edges) * 0.96, align="edge", color=BAR, lw=0)
    axes.set(xlabel="true depth (m)", ylabel="mean error (m)", xlim=(0, edges[-1]))
    axes.grid(axis="y")
    return figure


def stage_chart(stages: Sequence[StageSummary]) -> Figure:
    """Time of each stage on the wall as bars in the order of the flow; call within `figure_style()`."""
    height_px = 90 + 34 * len(stages)
    left_px = 50 + 8 * max((len(stage.name) for stage in stages), default=0)
    figure = new_figure(_BROAD_PX, height_px)
    axes = figure.add_axes((left_px / _BROAD_PX, 62 / height_px, 1 - (left_px + 26) / _BROAD_PX, 1 - 70 / height_px))
    seconds = [stage.wall_seconds for stage in stages]
    axes.barh(range(len(stages)), seconds, height=0.66, color=BAR, lw=0)
    for row, stage in enumerate(stages):
        rate = "" if stage.done_per_s is None else f", {stage.done_per_s:.3g} units per s"
        text = f"{stage.wall_seconds:.1f} s" + rate
        axes.annotate(
            text, (stage.wall_seconds, row), xytext=(6, 0), textcoords="offset points", va="center", fontsize=10
        )
    axes.set_yticks(range(len(stages)), [stage.name for stage in stages])
    axes.invert_yaxis()
    axes.set(xlabel="time on the wall in which its units were worked on (s)", ylabel="stage (name)")
    axes.set_xlim(0, max(seconds, default=0.0) * 1.3 or 1.0)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x")
    return figure


def _chart() -> tuple[Figure, Axes]:
    figure = new_figure(_WIDTH_PX, _HEIGHT_PX)
    axes = figure.add_axes((0.21, 0.23, 0.75, 0.65))
    axes.tick_params(color=MUTED, labelcolor=INK)
    return figure, axes
