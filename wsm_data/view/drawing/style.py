"""How figures look, and how one becomes bytes: no pyplot, no global state, no dependence on a user's matplotlibrc."""

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from wsm_data.schema.arrays import Uint8Array

INK = "#1f2a33"
MUTED = "#5a6872"
GRID = "#d9dee3"
BAR = "#3465a4"
BAR_SECOND = "#e08a1e"

_NO_METADATA: dict[str, Any] = {"Software": None}  # None takes the entry out; matplotlib's hints allow only text
_STYLE: Mapping[str, object] = MappingProxyType(
    {
        "axes.axisbelow": True,
        "axes.edgecolor": MUTED,
        "axes.grid": False,
        "axes.labelcolor": INK,
        "axes.labelsize": 11,
        "axes.linewidth": 0.8,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlecolor": INK,
        "axes.titlelocation": "left",
        "axes.titlesize": 12,
        "axes.titleweight": "bold",
        "figure.dpi": 100,
        "font.family": ["DejaVu Sans"],
        "font.size": 11,
        "grid.color": GRID,
        "grid.linewidth": 0.8,
        "hatch.linewidth": 0.7,
        "legend.fontsize": 10,
        "legend.frameon": False,
        "svg.fonttype": "none",
        "text.color": INK,
        "text.parse_math": False,  # a scene may be called `$x$`
        "xtick.color": MUTED,
        "xtick.labelcolor": INK,
        "xtick.labelsize": 10,
        "ytick.color": MUTED,
        "ytick.labelcolor": INK,
        "ytick.labelsize": 10,
    }
)


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw with matplotlib's own defaults and the style of the project; the caller's settings are put back after."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def new_figure(width_px: int, height_px: int) -> Figure:
    """Return an empty figure on an Agg canvas; call within `figure_style()`."""
    figure = Figure(figsize=(width_px / 100, height_px / 100), dpi=100)
    FigureCanvasAgg(figure)
    return figure


def figure_png(figure: Figure) -> bytes:
    """PNG of a figure at one pixel per hundredth of an inch, without a creation date or a program's name."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, facecolor="white", metadata=_NO_METADATA)
    return buffer.getvalue()


def picture_png(rgb_u8: Uint8Array) -> bytes:
    """PNG of a picture, uint8 [H, W, 3]."""
    buffer = io.BytesIO()
    imsave(buffer, np.ascontiguousarray(rgb_u8), format="png", metadata=_NO_METADATA)
    return buffer.getvalue()
