"""Pictures of post-training: groups on their maps, curves, and a film of the best and the worst dream of a query."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wsm_data.files.atomic import write_bytes
from wsm_data.files.jsonlines import read_lines
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import FREE, OCCUPIED
from wsm_data.view.clip.map_plot import FREE_COLOUR, GOAL_COLOUR, MAP_INK, OCCUPIED_COLOUR, PATH_COLOUR, UNKNOWN_COLOUR
from wsm_data.view.drawing.style import figure_png, figure_style, new_figure
from wsm_data.view.navigation.film import FilmFrame, write_film
from wsm_data.view.training.curves import draw_training_curves
from wsm_model.evaluation.decoding import Decoding
from wsm_model.posttraining.step import RolledOut

CURVE_UNITS = {
    "loss": "objective (1)",
    "reward": "s exp(-C / T), mean over dreams (1)",
    "unsafe_share": "share of dreams (1)",
    "reward_spread": "standard deviation in a group (1)",
    "skipped_share": "share of groups (1)",
    "reference": "squared distance to the pretrained velocity (1)",
    "learning_rate": "learning rate (1)",
}
_SAFE_COLOURS = ("#a9c6e3", "#0b3c6f")
_PANEL_PX = 420
_AROUND_M = 2.5


def draw_groups(rolled: Sequence[RolledOut], title: str, path: Path) -> None:
    """Write a PNG with a panel a query: its map, where it stands, and where its dreams lead."""
    columns = min(4, len(rolled))
    rows = -(-len(rolled) // columns)
    with figure_style():
        figure = new_figure(columns * _PANEL_PX, rows * _PANEL_PX + 60)
        for number, one in enumerate(rolled):
            _draw_group(figure.add_subplot(rows, columns, number + 1), one)
        figure.suptitle(title, color=MAP_INK)
        lines = [
            Line2D([], [], color=PATH_COLOUR, lw=1.5, label="unsafe dream"),
            Line2D([], [], color=_SAFE_COLOURS[0], lw=1.5, label="safe dream, little reward"),
            Line2D([], [], color=_SAFE_COLOURS[1], lw=1.5, label="safe dream, the most reward"),
        ]
        figure.legend(handles=lines, loc="lower center", ncols=3, frameon=False)
        figure.tight_layout(rect=(0, 0.06, 1, 1))
        write_bytes(path, figure_png(figure))


def _draw_group(axes: Axes, one: RolledOut) -> None:
    grid, group = one.query.reward_map.grid, one.group
    colours = {FREE: FREE_COLOUR, OCCUPIED: OCCUPIED_COLOUR}
    picture = np.empty((*grid.cells.shape, 3), np.uint8)
    picture[:] = _rgb(UNKNOWN_COLOUR)
    for value, colour in colours.items():
        picture[grid.cells == value] = _rgb(colour)
    x, y = grid.origin_xy_m
    height, width = (size * grid.resolution_m for size in grid.cells.shape)
    axes.imshow(picture, origin="lower", extent=(x, x + width, y, y + height), interpolation="nearest")
    field = np.where(one.query.reward_map.geodesic_mm < 65535, one.query.reward_map.geodesic_mm / 1000.0, np.nan)
    if np.isfinite(field).any():
        centres = [
            start + (np.arange(size) + 0.5) * grid.resolution_m
            for start, size in zip((x, y), field.shape[::-1], strict=True)
        ]
        axes.contour(
            *centres, field, levels=np.arange(0, np.nanmax(field) + 0.5, 0.5), colors=GOAL_COLOUR, linewidths=0.4
        )
    most = max(float(group.scored.reward.max()), 1e-9)
    for dream in np.argsort(group.scored.reward):
        way = np.concatenate([group.start_xy_m[None], group.paths_xy_m[dream]])
        share = float(group.scored.reward[dream]) / most
        axes.plot(*way.T, color=_between(share) if group.scored.safe[dream] else PATH_COLOUR, lw=1.2)
    axes.plot(*group.start_xy_m, "o", color=MAP_INK, ms=4)
    axes.set_xlim(group.start_xy_m[0] - _AROUND_M, group.start_xy_m[0] + _AROUND_M)
    axes.set_ylim(group.start_xy_m[1] - _AROUND_M, group.start_xy_m[1] + _AROUND_M)
    safe = int(group.scored.safe.sum())
    where = f"{one.query.key.split('/', 1)[1]} at {one.query.replan_latent}"
    axes.set_title(f"{where}: {safe} of {len(group.scored.safe)} safe", fontsize=8)
    axes.set(xlabel="x (m)", ylabel="y (m)")


def draw_curves(run: Path) -> None:
    """Write curves.png of a run's metrics."""
    records = list(read_lines(run / "metrics.jsonl"))
    if records:
        draw_training_curves(records, CURVE_UNITS, run / "curves.png")


def film_group(one: RolledOut, decoding: Decoding, path: Path) -> None:
    """Write an MP4: the dream with the most reward on the left, the one with the least on the right, both ways below.

    Raises:
        OSError: this OpenCV cannot write such a film there.
    """
    order = np.argsort(one.group.scored.reward, kind="stable")
    worst, best = int(order[0]), int(order[-1])
    grid = one.query.reward_map.grid
    row, column = np.unravel_index(int(np.argmin(one.query.reward_map.geodesic_mm)), grid.cells.shape)
    goal = np.array(grid.origin_xy_m) + (np.array([column, row]) + 0.5) * grid.resolution_m
    write_film(path, grid, goal, _frames(one, decoding, best, worst))


def _frames(one: RolledOut, decoding: Decoding, best: int, worst: int) -> Iterator[FilmFrame]:
    videos = [decoding.rgb_u8(one.group.rgb[dream])[-one.group.paths_xy_m.shape[1] :] for dream in (best, worst)]
    ways = [np.concatenate([one.group.start_xy_m[None], one.group.paths_xy_m[dream]]) for dream in (best, worst)]
    scored = one.group.scored
    words = [
        f"{'safe' if scored.safe[dream] else 'unsafe'}, reward {scored.reward[dream]:.2f}" for dream in (best, worst)
    ]
    for number in range(min(len(video) for video in videos)):
        yield FilmFrame(
            seen_u8=videos[0][number],
            beside_u8=videos[1][number],
            true_m=_until(ways[0], number),
            estimated_m=_until(ways[1], number),
            caption=(one.query.key, f"left, red: best ({words[0]})", f"right, blue: worst ({words[1]})"),
        )


def _until(way_m: Float64Array, number: int) -> Float64Array:
    return way_m[: number + 2]


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[place : place + 2], 16) for place in (1, 3, 5))


def _between(share: float) -> tuple[float, ...]:
    ends = [np.array(_rgb(colour)) / 255 for colour in _SAFE_COLOURS]
    return tuple((ends[0] + share * (ends[1] - ends[0])).tolist())
