"""From episodes to the numbers and tables of an evaluation."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pipelines.evaluating.nav.config import NavConfig
from pipelines.evaluating.nav.drive import Driven
from wsm_data.files.json_values import to_json
from wsm_data.files.tables import with_statement, write_table
from wsm_data.metrics.bootstrap import estimate_over_scenes
from wsm_data.planners.planner import GoalFrame
from wsm_data.sim.result import EpisodeResult

EPISODES_VERSION = 1
_TYPES: Mapping[Any, Any] = {
    str: pa.string(),
    int: pa.int64(),
    float: pa.float64(),
    bool: pa.bool_(),
    float | None: pa.float64(),
}

_Number = Callable[[EpisodeResult], float | None]
MEASURES: dict[str, _Number] = {
    "success_rate": lambda one: float(one.success),
    "spl_geodesic": lambda one: one.spl_geodesic,
    "spl_straight": lambda one: one.spl_straight,
    "collision_rate": lambda one: float(one.collisions > 0),
    "near_miss_rate": lambda one: float(one.near_misses > 0),
    "navigation_error_m": lambda one: one.navigation_error_m,
    "localisation_error_m": lambda one: one.localisation_error_m,
    "ate_rmse_unaligned_m": lambda one: one.ate_rmse_unaligned_m,
    "seconds": lambda one: one.seconds,
    "driven_m": lambda one: one.driven_m,
}
"""What the summary says of an episode, by name; docs/closed_loop.md defines them."""


def summarise(driven: Sequence[Driven], config: NavConfig) -> dict[str, Any]:
    """The object of summary.json; a measure that no episode has is null."""
    results = [one.result for one in driven if one.result is not None]
    senses = sorted({sense for one in driven for sense in one.senses})
    estimates = {name: _estimate(results, measure, config.seed) for name, measure in MEASURES.items()}
    return {
        **estimates,
        "planner": results[0].planner if results else config.planner,
        "inputs": [*senses, "goal"],
        "goal": "fixed" if config.sim.goal == GoalFrame.START else "oracle",
        "controller_pose": "estimated" if config.sim.estimated_controller_pose else "true",
        "protocol": config.sim.protocol,
        "latency_steps": config.sim.latency_steps,
        "world": Path(config.world).name,
        "scenes": len({one.scene for one in results}),
        "episodes": len(results),
        "endings": dict(sorted(Counter(one.ending.value for one in results).items())),
        "refused": dict(sorted(Counter(one.reason for one in driven if one.reason).items())),
    }


def write_episodes_table(path: Path, driven: Sequence[Driven]) -> None:
    """Write the table of episodes, a row for each that was driven, in the order of their scenes and numbers."""
    columns = [(field.name, _TYPES.get(field.type, pa.string())) for field in fields(EpisodeResult)]
    schema = with_statement(pa.schema(columns), "wsm.episodes", {"version": EPISODES_VERSION})
    rows = [to_json(asdict(one.result)) for one in driven if one.result is not None]
    write_table(path, pa.Table.from_pylist(rows, schema))


def _estimate(results: Sequence[EpisodeResult], measure: _Number, seed: int) -> dict[str, Any] | None:
    found = [(value, one.scene) for one in results if (value := measure(one)) is not None]
    if not found:
        return None
    values = np.array([value for value, _ in found])
    return asdict(estimate_over_scenes(values, [scene for _, scene in found], seed))
