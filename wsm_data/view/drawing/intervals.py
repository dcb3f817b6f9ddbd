"""Numbers of several systems with their intervals, as bars one below the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from wsm_data.files.atomic import write_bytes
from wsm_data.view.drawing.style import BAR, MUTED, figure_png, figure_style, new_figure

_PANEL_PX, _ROW_PX, _FRAME_PX = 640, 30, 110


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One number.

    Attributes:
        name: of its row.
        value: the number.
        interval: its lower and upper end; None where it has none.
        muted: drawn in grey, as what others have published is.
    """

    name: str
    value: float
    interval: tuple[float, float] | None
    muted: bool


def draw_intervals(panels: Mapping[str, Sequence[Bar]], title: str, path: Path) -> None:
    """Write a PNG with a panel for each number, its name on the axis; the first row stands at the top.

    Raises:
        ValueError: there is no panel.
    """
    if not panels:
        raise ValueError("a picture of intervals needs at least one number")
    rows = max(len(bars) for bars in panels.values())
    with figure_style():
        figure = new_figure(len(panels) * _PANEL_PX, rows * _ROW_PX + _FRAME_PX)
        for number, (label, bars) in enumerate(panels.items()):
            axes = figure.add_subplot(1, len(panels), number + 1)
            places = range(len(bars))
            colours = [MUTED if bar.muted else BAR for bar in bars]
            axes.barh(places, [bar.value for bar in bars], color=colours, height=0.6)
            for place, bar in enumerate(bars):
                if bar.interval is not None:
                    axes.plot(bar.interval, (place, place), color="black", lw=1.2)
            axes.set_yticks(places, [bar.name for bar in bars])
            axes.set(xlabel=label)
            axes.invert_yaxis()
        figure.suptitle(title)
        figure.tight_layout()
        write_bytes(path, figure_png(figure))
