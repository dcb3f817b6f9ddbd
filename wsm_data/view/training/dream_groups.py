"""Groups of dreams from above: where each leads on the map of its query, and what it is worth."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import BoolArray, Float64Array, Uint16Array
from wsm_data.schema.clip import UNREACHABLE_MM
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid
from wsm_data.view.clip.map_plot import FREE_COLOUR, GOAL_COLOUR, MAP_INK, OCCUPIED_COLOUR, PATH_COLOUR, UNKNOWN_COLOUR
from wsm_data.view.drawing.style import figure_png, figure_style, new_figure

_SAFE_COLOURS = ("#a9c6e3", "#0b3c6f")
_PANEL_PX = 420
_AROUND_M = 2.5
_COLUMNS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class DreamGroup:
    """The dreams of one query.

    Attributes:
        title: which query.
        grid: its map.
        geodesic_mm: distance to the goal, mm; uint16 [Y, X].
        start_xy_m: where the dreams begin, in the world, m; float64 [2].
        paths_xy_m: where they lead; float64 [G, L, 2].
        safe: whether the footprint stays in free space; bool [G].
        reward: of each; float64 [G].
    """

    title: str
    grid: OccupancyGrid
    geodesic_mm: Uint16Array
    start_xy_m: Float64Array
    paths_xy_m: Float64Array
    safe: BoolArray
    reward: Float64Array


def draw_dream_groups(groups: Sequence[DreamGroup], title: str, path: Path) -> None:
    """Write a PNG with a panel a group, replaced atomically."""
    columns = min(_COLUMNS, len(groups))
    rows = -(-len(groups) // columns)
    with figure_style():
        figure = new_figure(columns * _PANEL_PX, rows * _PANEL_PX + 60)
        for number, group in enumerate(groups):
            _draw(figure.add_subplot(rows, columns, number + 1), group)
        figure.suptitle(title, color=MAP_INK)
        lines = [
            Line2D([], [], color=PATH_COLOUR, lw=1.5, label="unsafe dream"),
            Line2D([], [], color=_SAFE_COLOURS[0], lw=1.5, label="safe dream, little reward"),
            Line2D([], [], color=_SAFE_COLOURS[1], lw=1.5, label="safe dream, the most reward"),
            Line2D([], [], color=GOAL_COLOUR, lw=0.8, label="every half metre to the goal"),
        ]
        figure.legend(handles=lines, loc="lower center", ncols=len(lines) if columns > 1 else 2, frameon=False)
        figure.tight_layout(rect=(0, 0.06, 1, 1))
        write_bytes(path, figure_png(figure))


def _draw(axes: Axes, group: DreamGroup) -> None:
    grid = group.grid
    picture = np.empty((*grid.cells.shape, 3), np.uint8)
    picture[:] = _rgb(UNKNOWN_COLOUR)
    for value, colour in ((FREE, FREE_COLOUR), (OCCUPIED, OCCUPIED_COLOUR)):
        picture[grid.cells == value] = _rgb(colour)
    x, y = grid.origin_xy_m
    height, width = (size * grid.resolution_m for size in grid.cells.shape)
    axes.imshow(picture, origin="lower", extent=(x, x + width, y, y + height), interpolation="nearest")
    field_m = np.where(group.geodesic_mm == UNREACHABLE_MM, np.nan, group.geodesic_mm / 1000.0)
    if np.isfinite(field_m).any():
        across, up = (
            start + (np.arange(size) + 0.5) * grid.resolution_m
            for start, size in zip((x, y), field_m.shape[::-1], strict=True)
        )
        levels = np.arange(0, np.nanmax(field_m) + 0.5, 0.5)
        axes.contour(across, up, field_m, levels=levels, colors=GOAL_COLOUR, linewidths=0.4)
    most = max(float(group.reward.max()), 1e-9)
    for dream in np.argsort(group.reward):  # the best lies on top
        way = np.concatenate([group.start_xy_m[None], group.paths_xy_m[dream]])
        worth = _between(float(group.reward[dream]) / most) if group.safe[dream] else PATH_COLOUR
        axes.plot(way[:, 0], way[:, 1], color=worth, lw=1.2)
    axes.plot(*group.start_xy_m, "o", color=MAP_INK, ms=4)
    axes.set_xlim(group.start_xy_m[0] - _AROUND_M, group.start_xy_m[0] + _AROUND_M)
    axes.set_ylim(group.start_xy_m[1] - _AROUND_M, group.start_xy_m[1] + _AROUND_M)
    axes.set_title(f"{group.title}: {int(group.safe.sum())} of {len(group.safe)} safe", fontsize=8)
    axes.set(xlabel="x (m)", ylabel="y (m)")


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[place : place + 2], 16) for place in (1, 3, 5))


def _between(share: float) -> tuple[float, float, float]:
    ends = [np.array(_rgb(colour)) / 255 for colour in _SAFE_COLOURS]
    red, green, blue = (ends[0] + share * (ends[1] - ends[0])).tolist()
    return red, green, blue
