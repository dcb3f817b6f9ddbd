"""Geodesic distance to a goal on indoor maps: error against exact any-angle paths, and time, beside the alternatives.

Contestants: ours (`geodesic_field`), second-order fast marching (scikit-fmm), and Dijkstra's algorithm over eight
neighbours (scipy). All get the same traversable cells and a goal in the centre of one. Ours also fills in the cells
beside obstacles, which the others leave out; its time includes that. Run as `python bench/geodesic.py`.
"""

import statistics
import time
from collections.abc import Callable

import numpy as np
import skfmm
from any_angle_reference import shortest_paths
from indoor_maps import RESOLUTION_M, indoor_map
from reporting import machine, machine_line, table, write_results
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from wsm_data.maps.footprint import traversable
from wsm_data.maps.geodesic import geodesic_field
from wsm_data.schema.occupancy import FREE

ROBOT_RADIUS_M = 0.25
GOAL_RADIUS_M = 0.2
REACH_M = 2**0.5 * ROBOT_RADIUS_M
ACCURACY_MAPS = ((128, 0), (128, 1), (128, 2), (128, 3), (128, 4), (128, 5), (192, 0), (192, 1), (256, 0))
TIMED_MAPS = ((128, 0), (256, 0), (256, 1), (256, 2), (256, 3), (512, 0))
ROUNDS = 15
OURS = "ours"
Task = tuple[np.ndarray, np.ndarray, tuple[int, int]]


def make_task(size: int, seed: int) -> Task:
    """Traversable cells, blocked cells, and a goal (column, row) in the largest part of the home."""
    grid = indoor_map(size, seed)
    free = traversable(grid, ROBOT_RADIUS_M)
    parts, _ = label(free)
    largest = np.argwhere(parts == np.bincount(parts[free]).argmax())
    row, column = largest[np.random.default_rng(seed).integers(len(largest))]
    return free, grid.cells != FREE, (int(column), int(row))


def ours(free: np.ndarray, blocked: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    field = geodesic_field(free, blocked, (float(goal[0]), float(goal[1])), RESOLUTION_M, 0.0, REACH_M)
    return np.where(free, field, np.inf)


def fast_marching(free: np.ndarray, _blocked: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Marching starts from the circle of the goal region: from a single cell its errors are larger."""
    rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
    straight = np.hypot(columns - goal[0], rows - goal[1]) * RESOLUTION_M
    phi = np.ma.MaskedArray(straight - GOAL_RADIUS_M, ~free)
    found = np.ma.filled(skfmm.travel_time(phi, np.ones(free.shape), dx=RESOLUTION_M, order=2), np.inf)
    inside = free & (straight < GOAL_RADIUS_M)
    return np.where(inside, straight, found + GOAL_RADIUS_M)


def eight_neighbours(free: np.ndarray, _blocked: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Steps to the eight neighbours, diagonal ones only where both cells beside them are traversable."""
    index = np.arange(free.size).reshape(free.shape)
    starts, ends, lengths = [], [], []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        low, high = max(0, -dx), free.shape[1] - max(0, dx)
        here, there = np.s_[: free.shape[0] - dy, low:high], np.s_[dy:, low + dx : high + dx]
        ok = free[here] & free[there]
        if dx and dy:
            ok &= free[: free.shape[0] - dy, low + dx : high + dx] & free[dy:, low:high]
        starts.append(index[here][ok])
        ends.append(index[there][ok])
        lengths.append(np.full(int(ok.sum()), np.hypot(dx, dy) * RESOLUTION_M))
    entries = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
    graph = coo_array(entries, shape=(free.size, free.size)).tocsr()
    return dijkstra(graph, directed=False, indices=index[goal[1], goal[0]]).reshape(free.shape)


CONTESTANTS: dict[str, Callable[..., np.ndarray]] = {
    OURS: ours,
    "scikit-fmm, order 2": fast_marching,
    "8-neighbour Dijkstra, scipy": eight_neighbours,
}


def relative_errors(found_m: np.ndarray, reference_m: np.ndarray) -> np.ndarray:
    """Relative errors of all cells with a distance that lie outside the goal region."""
    if not np.array_equal(np.isfinite(found_m), np.isfinite(reference_m)):
        raise ValueError("a contestant reaches other cells than the reference")
    told_apart = np.isfinite(reference_m) & (reference_m > GOAL_RADIUS_M)
    return found_m[told_apart] / reference_m[told_apart] - 1


def measure_accuracy(size: int, seed: int) -> dict[str, object]:
    task = make_task(size, seed)
    reference_m = shortest_paths(task[0], *task[2]) * RESOLUTION_M
    result = {"size": size, "seed": seed, "cells": int(np.isfinite(reference_m).sum()), "errors": {}}
    result["longest_m"] = float(reference_m[np.isfinite(reference_m)].max())
    for name, contestant in CONTESTANTS.items():
        errors = relative_errors(contestant(*task), reference_m)
        result["errors"][name] = {
            "mean": float(np.abs(errors).mean()),
            "max": float(np.abs(errors).max()),
            "lowest": float(errors.min()),
        }
    return result


def measure_time(size: int, seed: int) -> dict[str, object]:
    """Milliseconds of every contestant, taking turns, each round started by another one."""
    task = make_task(size, seed)
    seconds: dict[str, list[float]] = {name: [] for name in CONTESTANTS}
    names = list(CONTESTANTS)
    for turn in range(ROUNDS + 1):
        for name in names[turn % len(names) :] + names[: turn % len(names)]:
            start = time.perf_counter()
            CONTESTANTS[name](*task)
            if turn > 0:  # the first round compiles and warms up
                seconds[name].append(time.perf_counter() - start)
    result = {"size": size, "seed": seed, "cells": int(np.isfinite(ours(*task)).sum()), "times": {}}
    for name, times in seconds.items():
        ratios = sorted(mine / theirs for mine, theirs in zip(seconds[OURS], times, strict=True))
        result["times"][name] = {
            "median_ms": statistics.median(times) * 1e3,
            "spread_ms": [min(times) * 1e3, max(times) * 1e3],
            "ours_takes": statistics.median(ratios),
            "ours_takes_spread": [ratios[0], ratios[-1]],
        }
    return result


def accuracy_table(results: list[dict[str, object]]) -> list[str]:
    rows = []
    for result in results:
        errors = [f"{100 * e['mean']:.3f} % / {100 * e['max']:.2f} %" for e in result["errors"].values()]
        cells = f"{result['size']} x {result['size']}, {result['cells']} cells"
        rows.append([cells, f"{result['longest_m']:.1f} m", *errors])
    return table(["map, cells reached", "longest way", *CONTESTANTS], rows)


def time_table(results: list[dict[str, object]]) -> list[str]:
    rows = []
    for result in results:
        times = [f"{t['median_ms']:.1f} ms" for t in result["times"].values()]
        fmm = result["times"]["scikit-fmm, order 2"]
        low, high = fmm["ours_takes_spread"]
        ratio = f"{fmm['ours_takes']:.2f} ({low:.2f} to {high:.2f})"
        rows.append([f"{result['size']} x {result['size']}, {result['cells']} cells", *times, ratio])
    return table(["map, cells reached", *CONTESTANTS, "ours / scikit-fmm (spread)"], rows)


def main() -> None:
    setup = machine("numpy", "numba", "scipy", "scikit-fmm")
    times = [measure_time(*case) for case in TIMED_MAPS]
    accuracy = [measure_accuracy(*case) for case in ACCURACY_MAPS]
    lines = [
        "# Geodesic distance on indoor maps",
        "",
        f"Maps of {RESOLUTION_M} m a cell, robot radius {ROBOT_RADIUS_M} m. The reference are shortest paths over the",
        "graph of all mutually visible cell centres (strict supercover). Errors are relative, over all cells farther",
        f"than {GOAL_RADIUS_M} m from the goal: mean of the size / largest. Ours is never below the reference by more",
        f"than rounding: lowest relative error {min(r['errors'][OURS]['lowest'] for r in accuracy):.1e}.",
        "",
        *accuracy_table(accuracy),
        "",
        f"Medians of {ROUNDS} alternating rounds, one thread; the ratio is taken within each round. Ours includes the",
        "cells beside obstacles, which the others leave out; Dijkstra includes building its graph.",
        "",
        *time_table(times),
        "",
        machine_line(setup),
    ]
    write_results("geodesic", {"machine": setup, "accuracy": accuracy, "times": times}, lines)


if __name__ == "__main__":
    main()
