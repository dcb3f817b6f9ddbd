"""The map of a scene with the ways that were driven through it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.view.clip.map_plot import GOAL_COLOUR, PATH_COLOUR, TRAIN_COLOUR, cell_picture
from wsm_data.view.drawing.style import figure_png, figure_style, new_figure

_SIDE_PX = 720
_MARGIN_PX = 70


@dataclass(frozen=True, kw_only=True)
class DrivenPath:
    """One episode, in the world, m.

    Attributes:
        true_m: where the robot was; float64 [S, 2].
        goal_m: its goal; float64 [2].
        success: whether it counts as a success.
    """

    true_m: Float64Array
    goal_m: Float64Array
    success: bool


def draw_paths(path: Path, title: str, grid: OccupancyGrid, driven: Sequence[DrivenPath]) -> None:
    """Write a PNG: successes blue, failures red, goals green; replaced atomically."""
    rows, columns = grid.cells.shape
    (left, bottom), cell = grid.origin_xy_m, grid.resolution_m
    scale = (_SIDE_PX - 2 * _MARGIN_PX) / max(rows, columns)
    with figure_style():
        figure = new_figure(*(round(2 * _MARGIN_PX + scale * count) for count in (columns, rows)))
        axes = figure.add_subplot()
        axes.imshow(
            cell_picture(grid, np.zeros(grid.cells.shape)),
            origin="lower",
            extent=(left, left + columns * cell, bottom, bottom + rows * cell),
            interpolation="nearest",
        )
        for one in driven:
            colour = TRAIN_COLOUR if one.success else PATH_COLOUR
            axes.plot(*one.true_m.T, color=colour, lw=1.6)
            axes.plot(*one.true_m[0], marker="o", ms=5, color=colour, mec="white")
            axes.plot(*one.goal_m, marker="*", ms=11, color=GOAL_COLOUR, mec="white")
        count = sum(one.success for one in driven)
        axes.set(title=f"{title}: {count} of {len(driven)} arrive", xlabel="world x (m)", ylabel="world y (m)")
        write_bytes(path, figure_png(figure))
