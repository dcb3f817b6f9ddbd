"""Do the built-in planners order as they must? The same episodes in homes of a fresh seed, under the paper's protocol.

The oracle knows the map and must nearly always arrive, close to the geodesic optimum; map-and-plan sees depth alone;
the reactive planner has no memory; the straight line sees nothing. Episodes that were driven stay in runs/planners, so
a run that was cut short goes on.
"""

import os
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from reporting import machine, machine_line, table, write_results

from pipelines.evaluating.nav.config import NavConfig
from pipelines.evaluating.nav.run import evaluate_navigation

SEED = 2000
EPISODES = 200
PLANNERS = ("oracle", "map-and-plan", "reactive", "straight-line")
FOLDER = Path(__file__).parents[1] / "runs" / "planners"
COLUMNS = ("success_rate", "spl_geodesic", "spl_straight", "collision_rate")


def main() -> None:
    parser = ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--folder", type=Path, default=FOLDER)
    chosen = parser.parse_args()
    summaries = {name: evaluated(name, chosen.folder, chosen.episodes) for name in PLANNERS}
    here = machine("numpy")
    record: dict[str, object] = {"machine": here, "seed": SEED, "planners": summaries}
    write_results("planners", record, page(summaries, here))


def evaluated(name: str, folder: Path, episodes: int) -> dict[str, Any]:
    """The summary of a planner."""
    config = NavConfig(planner=name, seed=SEED)
    workers = len(os.sched_getaffinity(0))
    return evaluate_navigation(config, folder / name, episodes=episodes, workers=workers, films=0, quiet=False)


def page(summaries: dict[str, dict[str, Any]], here: dict[str, object]) -> list[str]:
    rows = [
        [name, ", ".join(one["inputs"]), str(one["episodes"]), *(interval(one[column]) for column in COLUMNS)]
        for name, one in summaries.items()
    ]
    first = summaries[PLANNERS[0]]
    return [
        "# Built-in planners in homes of a fresh seed",
        "",
        f"The same episodes for all, in {first['scenes']} homes of seed {SEED}, protocol {first['protocol']}, goal "
        f"{first['goal']}, controller on {first['controller_pose']} poses, latency {first['latency_steps']} step. "
        "Means over homes with 95 % intervals of a bootstrap over homes.",
        "",
        *table(["planner", "inputs", "episodes", *(column.replace("_", " ") for column in COLUMNS)], rows),
        "",
        machine_line(here),
    ]


def interval(estimate: dict[str, float]) -> str:
    return f"{estimate['value']:.3f} [{estimate['low']:.3f}, {estimate['high']:.3f}]"


if __name__ == "__main__":
    main()
