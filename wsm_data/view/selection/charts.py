"""Charts of a selection, each a figure of its own: call them within `figure_style()`."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from wsm_data.schema.arrays import Float64Array
from wsm_data.view.drawing.style import BAR, BAR_SECOND, INK, MUTED, new_figure

_WIDTH_PX, _HEIGHT_PX = 370, 236
_BROAD_PX = 860
_BINS = 24
_TAIL = 0.995


def compared_histogram(everything: Float64Array, chosen: Float64Array, label: str, share: bool) -> Figure:
    """Distribution of a score over all clips, filled, and over the chosen ones, as a line; each sums to 100 %.

    Args:
        everything: values of all clips, at least one.
        chosen: values of the chosen ones.
        label: name and unit of the score, below the axis.
        share: whether values are shares, written in per cent.
    """
    figure, axes = _chart()
    edges = shared_edges(everything)
    all_shares, chosen_shares = (_shares(values, edges) for values in (everything, chosen))
    axes.stairs(all_shares, edges, fill=True, color=BAR, alpha=0.55, lw=0)
    axes.stairs(chosen_shares, edges, color=BAR_SECOND, lw=2.2)
    named = {"all": everything, "chosen": chosen}
    beyond = {name: 100 * float((values > edges[-1]).mean()) for name, values in named.items() if len(values)}
    if any(beyond.values()):
        text = f"beyond: {', '.join(f'{share:.2g} % of {name}' for name, share in beyond.items())}"
        axes.set_title(text, loc="right", fontsize=9, fontweight="normal", color=MUTED)
    axes.set(xlabel=label, ylabel="share of clips (%)", xlim=(edges[0], edges[-1]))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5))
    if share:
        axes.xaxis.set_major_formatter(FuncFormatter(_percent))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4))
    axes.yaxis.set_major_formatter(FuncFormatter(_percent))
    axes.grid(axis="y")
    return figure


def difficulty_chart(difficulty: Float64Array, chosen: Float64Array) -> Figure:
    """Difficulty of all candidates and of the chosen clips."""
    return compared_histogram(difficulty, chosen, "difficulty under the rule (0 to 1)", share=False)


def leading_chart(labels: Sequence[str], counts: Sequence[int]) -> Figure:
    """How many of the chosen clips each score made hard before all others, as bars."""
    height_px = 84 + 30 * len(labels)
    left_px = 64 + 8 * max((len(label) for label in labels), default=0)
    figure = new_figure(_BROAD_PX, height_px)
    axes = figure.add_axes((left_px / _BROAD_PX, 58 / height_px, 1 - (left_px + 40) / _BROAD_PX, 1 - 66 / height_px))
    axes.barh(range(len(labels)), counts, height=0.66, color=BAR_SECOND, lw=0)
    for row, count in enumerate(counts):
        text = f"{count:,} ({100 * count / max(sum(counts), 1):.0f} %)"
        axes.annotate(text, (count, row), xytext=(6, 0), textcoords="offset points", va="center", fontsize=10)
    axes.set_yticks(range(len(labels)), list(labels))
    axes.invert_yaxis()
    axes.set(xlabel="chosen clips (count)", ylabel="score (name)")
    axes.set_xlim(0, max(counts, default=0) * 1.2 or 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x")
    return figure


def shared_edges(values: Float64Array) -> Float64Array:
    """Edges of 24 bins from the least value to that below which 99.5 % lie; wider where that is a single one."""
    low, high = float(values.min()), float(np.quantile(values, _TAIL, method="higher"))
    if high <= low:
        high = float(values.max())
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, _BINS + 1)


def _shares(values: Float64Array, edges: Float64Array) -> Float64Array:
    return np.histogram(values, edges)[0] / max(len(values), 1)


def _percent(share: float, _position: int | None = None) -> str:
    return f"{100 * share:.3g}%"


def _chart() -> tuple[Figure, Axes]:
    figure = new_figure(_WIDTH_PX, _HEIGHT_PX)
    axes = figure.add_axes((0.21, 0.23, 0.75, 0.65))
    axes.tick_params(color=MUTED, labelcolor=INK)
    return figure, axes
