"""Curves of a training run: each part of the loss over the steps, raw and smoothed, and the learning rate."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.ticker import NullFormatter

from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import Float64Array
from wsm_data.view.drawing.style import BAR, MUTED, figure_png, figure_style, new_figure

_COLUMNS = 3
_PANEL_PX = (480, 300)
_SMOOTHING_SHARE = 0.02  # of the run; enough to see a slope through the noise of single batches


def smoothed(values: Float64Array, window: int) -> Float64Array:
    """Mean over the last `window` values, fewer at the start; [N]."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    ends = np.arange(1, len(values) + 1)
    starts = np.maximum(0, ends - window)
    return np.asarray((sums[ends] - sums[starts]) / (ends - starts))


def draw_training_curves(records: Sequence[Mapping[str, object]], units: Mapping[str, str], path: Path) -> None:
    """Write the curves as a PNG, one panel for each name of `units` that any record has.

    Args:
        records: lines of a run's metrics: `step` and numbers by name; what was measured now and then is in some alone.
        units: what is drawn, with the label of its axis, in this order.
        path: where the PNG goes; replaced atomically.

    Raises:
        ValueError: there is not one record.
    """
    if not records:
        raise ValueError("a run without a logged step has no curves")
    held = {name: [record for record in records if name in record] for name in units}
    names = [name for name in units if held[name]]
    rows = -(-len(names) // _COLUMNS)
    with figure_style():
        figure = new_figure(_COLUMNS * _PANEL_PX[0], rows * _PANEL_PX[1])
        for number, name in enumerate(names):
            steps, values = (np.array([float(str(one[key])) for one in held[name]]) for key in ("step", name))
            window = max(1, round(_SMOOTHING_SHARE * len(steps)))
            axes = figure.add_subplot(rows, _COLUMNS, number + 1)
            axes.plot(steps, values, color=MUTED, lw=0.6, alpha=0.45)
            axes.plot(steps, smoothed(values, window), color=BAR, lw=1.8)
            axes.set(title=name.replace("_", " "), xlabel="optimiser step (count)", ylabel=units[name])
            if (values > 0).all() and values.max() > 8 * values.min():
                axes.set_yscale("log")
                axes.yaxis.set_major_formatter(_short)
                axes.yaxis.set_minor_formatter(NullFormatter())
            axes.grid(axis="y")
        figure.tight_layout()
        write_bytes(path, figure_png(figure))


def _short(value: float, _place: float) -> str:
    """A power of ten as a plain number: formulas are not typeset, since a scene may be called `$x$`."""
    return f"{value:g}"
