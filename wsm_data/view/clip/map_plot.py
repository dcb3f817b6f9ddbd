"""A map seen from above: what is free, occupied and unknown, the geodesic field, the expert's path and its goal."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle

from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid
from wsm_data.shards.names import TRAIN_SPLIT
from wsm_data.view.clip.facts import clip_field_m, world_path_m
from wsm_data.view.clip.scene_overview import SceneOverview

FREE_COLOUR = "#ffffff"
TIGHT_COLOUR = "#f3e6d3"
OCCUPIED_COLOUR = "#37434d"
UNKNOWN_COLOUR = "#e6e9ec"
UNKNOWN_LINES = "#aab4bd"
PATH_COLOUR = "#c9283e"
TRAIN_COLOUR = "#1f66b1"
GOAL_COLOUR = "#00796b"
MAP_INK = "#1f2a34"  # over the map's own white, so it must not follow a dark theme
# Dark near the goal, still legible on white far from it.
_CONTOUR_ENDS = ("#0b3c6f", "#7fa9d1")
_CONTOURS = LinearSegmentedColormap.from_list("distance", _CONTOUR_ENDS)
_UNKNOWN_CSS = f"repeating-linear-gradient(135deg, {UNKNOWN_COLOUR} 0 4px, {UNKNOWN_LINES} 4px 5px)"
_GOAL_CSS = f"radial-gradient(circle, {GOAL_COLOUR}55 45%, {GOAL_COLOUR} 50% 62%, white 66%)"


def _line_css(colour: str, width_px: int) -> str:
    return f"linear-gradient({colour}, {colour}) center / 100% {width_px}px no-repeat white"


MAP_SWATCHES = (
    ("free", FREE_COLOUR),
    ("free, but the robot does not fit", TIGHT_COLOUR),
    ("occupied", OCCUPIED_COLOUR),
    ("unknown", _UNKNOWN_CSS),
    ("geodesic distance to the goal (m)", _line_css(_CONTOUR_ENDS[0], 2)),
    ("expert path", _line_css(PATH_COLOUR, 3)),
    ("goal region", _GOAL_CSS),
)
"""What `draw_map` shows, for a page: labels, each with a CSS background."""

SCENE_SWATCHES = (
    ("training path", _line_css(TRAIN_COLOUR, 3)),
    (
        "held-out path",
        f"repeating-linear-gradient(90deg, {PATH_COLOUR} 0 5px, white 5px 8px) center / 100% 3px no-repeat white",
    ),
    ("free", FREE_COLOUR),
    ("occupied", OCCUPIED_COLOUR),
    ("unknown", _UNKNOWN_CSS),
)
"""What `draw_scene_map` shows, likewise."""

_MAX_LEVELS = 10
_NUMBER_GAP_PX = 24
_STEPS_M = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
_HALO = (patheffects.withStroke(linewidth=2.5, foreground="white"),)


def draw_map(
    axes: Axes,
    grid: OccupancyGrid,
    field_m: Float64Array,
    path_xy_m: Float64Array,
    goal_xy_m: tuple[float, float],
    goal_radius_m: float,
    robot_radius_m: float,
) -> None:
    """Draw a map in world coordinates, metres, at equal scale on both axes.

    Args:
        axes: empty axes.
        grid: what is free, occupied, unknown.
        field_m: geodesic distance to the goal region, m, [Y, X]; NaN where the robot's centre cannot be or come from.
        path_xy_m: positions of the camera, world, m, [T, 2].
        goal_xy_m: centre of the goal region, world, m.
        goal_radius_m: radius of the goal region, m.
        robot_radius_m: radius of the robot's footprint, drawn at the start, m.
    """
    _draw_cells(axes, grid, field_m)
    _draw_contours(axes, grid, field_m)
    axes.add_patch(
        Circle(goal_xy_m, goal_radius_m, facecolor=f"{GOAL_COLOUR}55", edgecolor=GOAL_COLOUR, lw=1.8, zorder=4)
    )
    axes.add_patch(
        Circle(path_xy_m[0], robot_radius_m, fill=False, edgecolor=PATH_COLOUR, lw=1.4, ls=(0, (3, 2)), zorder=5)
    )
    axes.plot(*path_xy_m.T, color=PATH_COLOUR, lw=2.2, solid_capstyle="round", zorder=5)
    axes.plot(*path_xy_m[0], marker="o", ms=6, color=PATH_COLOUR, mec="white", mew=1.2, zorder=6)
    _frame_axes(axes, grid)


def draw_scene_map(axes: Axes, scene: SceneOverview) -> None:
    """Draw the joined map of a scene with the paths of its clips: training ones full, others dashed on top."""
    _draw_cells(axes, scene.grid, np.zeros(scene.grid.cells.shape))
    for path in sorted(scene.paths, key=lambda path: (path.split != TRAIN_SPLIT, path.key)):
        trained = path.split == TRAIN_SPLIT
        colour, dashes = (TRAIN_COLOUR, "-") if trained else (PATH_COLOUR, (0, (3, 1.2)))
        axes.plot(*path.path_xy_m.T, color=colour, ls=dashes, lw=1.5, alpha=0.85, zorder=4)
        axes.plot(*path.path_xy_m[-1], marker="o", ms=4.5, color=colour, mec="white", mew=0.8, zorder=5)
    _frame_axes(axes, scene.grid)


def draw_clip_map(axes: Axes, clip: Clip) -> None:
    """Draw the map of one clip with its field, path and goal."""
    meta = clip.meta
    draw_map(
        axes,
        clip.grid,
        clip_field_m(clip),
        world_path_m(clip)[:, :2],
        goal_xy_m=meta.goal_world_m[:2],
        goal_radius_m=meta.goal_radius_m,
        robot_radius_m=meta.robot_radius_m,
    )


def draw_frame_marks(axes: Axes, path_xy_m: Float64Array, frames: Sequence[int]) -> None:
    """Mark the positions of some frames on a drawn map and number them from 1.

    A mark whose number would touch the last numbered one stays a bare dot.
    """
    spots = path_xy_m[list(frames)]
    axes.plot(*spots.T, ls="", marker="o", ms=5, color=PATH_COLOUR, mec="white", mew=1.0, zorder=6)
    axes.apply_aspect()  # else the scale is not yet that of the drawing
    last_px = np.full(2, -np.inf)
    for number, spot in enumerate(spots, start=1):
        spot_px = axes.transData.transform(spot)
        if np.linalg.norm(spot_px - last_px) < _NUMBER_GAP_PX:
            continue
        last_px = spot_px
        axes.annotate(
            str(number),
            spot,
            xytext=(6, 5),
            textcoords="offset points",
            fontsize=10,
            fontweight="bold",
            color=PATH_COLOUR,
            path_effects=_HALO,
            zorder=7,
        )


def map_key() -> list[Patch | Line2D]:
    """Legend entries for everything `draw_map` draws."""
    edge: dict[str, Any] = {"edgecolor": MAP_INK, "lw": 0.6}
    return [
        Patch(facecolor=FREE_COLOUR, label="free", **edge),
        Patch(facecolor=TIGHT_COLOUR, label="free, but the robot does not fit", **edge),
        Patch(facecolor=OCCUPIED_COLOUR, label="occupied", **edge),
        Patch(facecolor=UNKNOWN_COLOUR, hatch="////", label="unknown", edgecolor=UNKNOWN_LINES, lw=0.6),
        Line2D([], [], color=_CONTOURS(0.4), label="geodesic distance to goal (m)"),
        Line2D([], [], color=PATH_COLOUR, lw=2.2, marker="o", mec="white", label="expert path, footprint at start"),
        Line2D([], [], ls="", marker="o", ms=10, mfc=f"{GOAL_COLOUR}55", mec=GOAL_COLOUR, label="goal region"),
    ]


def _frame_axes(axes: Axes, grid: OccupancyGrid) -> None:
    left, right, bottom, top = _extent_m(grid)
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="world x (m)", ylabel="world y (m)")
    axes.set_aspect("equal")
    axes.spines[:].set_visible(True)


def _extent_m(grid: OccupancyGrid) -> tuple[float, float, float, float]:
    (left, bottom), (rows, columns) = grid.origin_xy_m, grid.cells.shape
    return left, left + columns * grid.resolution_m, bottom, bottom + rows * grid.resolution_m


def _draw_cells(axes: Axes, grid: OccupancyGrid, field_m: Float64Array) -> None:
    # Hatching lies under everything; the cells' picture is transparent where they are unknown.
    left, right, bottom, top = _extent_m(grid)
    axes.add_patch(
        Rectangle(
            (left, bottom),
            right - left,
            top - bottom,
            facecolor=UNKNOWN_COLOUR,
            edgecolor=UNKNOWN_LINES,
            hatch="////",
            lw=0,
            zorder=0,
        )
    )
    axes.imshow(cell_picture(grid, field_m), origin="lower", extent=_extent_m(grid), interpolation="nearest", zorder=1)


def cell_picture(grid: OccupancyGrid, field_m: Float64Array) -> Uint8Array:
    """Colours of the cells, uint8 RGBA [Y, X, 4], in the order of the grid; transparent where they are unknown."""
    picture = np.zeros((*grid.cells.shape, 4), np.uint8)
    free, fits = grid.cells == FREE, np.isfinite(field_m)
    for where, colour in (
        (free & fits, FREE_COLOUR),
        (free & ~fits, TIGHT_COLOUR),
        (grid.cells == OCCUPIED, OCCUPIED_COLOUR),
    ):
        picture[where] = np.round(np.array(to_rgba(colour)) * 255)
    return picture


def _draw_contours(axes: Axes, grid: OccupancyGrid, field_m: Float64Array) -> None:
    levels = contour_levels_m(field_m)
    if not len(levels) or min(field_m.shape) < 2:
        return
    rows, columns = field_m.shape
    x_m = grid.cell_centres_xy_m(np.stack([np.arange(columns), np.zeros(columns)], axis=1))[:, 0]
    y_m = grid.cell_centres_xy_m(np.stack([np.zeros(rows), np.arange(rows)], axis=1))[:, 1]
    lines = axes.contour(
        x_m, y_m, np.ma.masked_invalid(field_m), levels=levels, cmap=_CONTOURS, linewidths=1.1, zorder=2
    )
    labels = axes.clabel(lines, fmt="%g m", fontsize=9, inline=True, inline_spacing=3)
    for label in labels:
        label.set(color=MAP_INK, path_effects=_HALO, zorder=3)


def contour_levels_m(field_m: Float64Array) -> Float64Array:
    """Round levels for the contours of a field, m: the finest step that needs no more than ten, zero left out."""
    if not np.isfinite(field_m).any():
        return np.zeros(0)
    top = float(np.nanmax(field_m))
    step = next((step for step in _STEPS_M if top / step <= _MAX_LEVELS), _STEPS_M[-1])
    return np.arange(step, top, step)
