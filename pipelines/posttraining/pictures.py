"""Pictures of post-training: groups on their maps, curves, and a film of the best and the worst dream of a query."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from wsm_data.files.jsonlines import read_lines
from wsm_data.schema.arrays import Float64Array
from wsm_data.view.navigation.film import FilmFrame, write_film
from wsm_data.view.training.curves import draw_training_curves
from wsm_data.view.training.dream_groups import DreamGroup, draw_dream_groups
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


def draw_groups(rolled: Sequence[RolledOut], title: str, path: Path) -> None:
    """Write a PNG with a panel a query: its map, where it stands, and where its dreams lead."""
    groups = [
        DreamGroup(
            title=f"{one.query.key.split('/', 1)[1]} at {one.query.replan_latent}",
            grid=one.query.reward_map.grid,
            geodesic_mm=one.query.reward_map.geodesic_mm,
            start_xy_m=one.group.start_xy_m,
            paths_xy_m=one.group.paths_xy_m,
            safe=one.group.scored.safe,
            reward=one.group.scored.reward,
        )
        for one in rolled
    ]
    draw_dream_groups(groups, title, path)


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
