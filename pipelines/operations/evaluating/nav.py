"""`wsm eval nav`: settings from words, the evaluation, and its numbers as text."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import typer

from pipelines.evaluating.nav.config import AGENT, NavConfig, fixed_settings
from pipelines.evaluating.nav.results import MEASURES
from pipelines.evaluating.nav.run import evaluate_navigation
from pipelines.evaluating.nav.scenes import list_scenes
from pipelines.running.settings import merge, parse_assignments
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config
from wsm_data.sim.config import SimConfig
from wsm_data.view.drawing.text_table import aligned


def nav_config(
    planner: str,
    model: Path | None,
    codec_weights: str,
    world: str,
    seed: int,
    episodes_per_scene: int,
    sim: Mapping[str, object],
    assignments: Sequence[str],
) -> NavConfig:
    """Settings of an evaluation.

    Args:
        planner: its name, or the URL of a server.
        model: folder of the agent's model.
        codec_weights: folder of the weights of its codec.
        world: `homes`, `miniworld`, or a folder of episodes.
        seed: of scenes and episodes.
        episodes_per_scene: how many.
        sim: settings of the simulation that have options of their own.
        assignments: `sim.KEY=value` and `agent.KEY=value` words; what an option says stands.

    Raises:
        ConfigError: a setting is wrong, or does not go with the planner.
    """
    words = parse_assignments(assignments)
    if unknown := sorted({*words} - {"sim", AGENT}):
        raise ConfigError(f"--set takes sim.KEY=value and agent.KEY=value, found the section {unknown[0]!r}")
    given = words.get("sim", {})
    if not isinstance(given, Mapping):
        raise ConfigError(f"--set takes sim.KEY=value, found sim={given}")
    if both := sorted({*given} & {*sim}):
        raise ConfigError(f"sim.{both[0]} has an option of its own; see `wsm eval nav --help`")
    return NavConfig(
        planner=planner,
        model=model,
        codec_weights=codec_weights,
        world=world,
        seed=seed,
        episodes_per_scene=episodes_per_scene,
        sim=build_config(SimConfig, merge(given, sim), "sim"),
        agent=_agent_config(planner, words.get(AGENT)),
    )


def eval_nav(
    config: NavConfig, out: Path, *, episodes: int, workers: int, films: int, dry_run: bool, quiet: bool
) -> None:
    """Evaluate, and print the numbers.

    Args:
        config: settings.
        out: folder of the evaluation.
        episodes: how many in all.
        workers: processes; 0: one a core.
        films: how many episodes get one.
        dry_run: show what would be done, write nothing.
        quiet: no progress bar.
    """
    if dry_run:
        typer.echo(json.dumps(fixed_settings(config), indent=1, sort_keys=True))
        for scene, numbers in list_scenes(config, episodes):
            typer.echo(f"{scene.name}: {len(numbers)} episodes")
        return
    chosen = workers or os.cpu_count() or 1
    summary = evaluate_navigation(config, out, episodes=episodes, workers=chosen, films=films, quiet=quiet)
    typer.echo(describe(summary))
    typer.echo(f"summary: {out / 'summary.json'}\nepisodes: {out / 'episodes.parquet'}\nmaps: {out / 'maps'}")


def describe(summary: Mapping[str, Any]) -> str:
    """The numbers of a summary as text; what no episode has is left out."""
    rows = [["", "value", "low", "high"]]
    for name in MEASURES:
        found = summary[name]
        if found is not None:
            rows.append([name, *(f"{found[end]:.3f}" for end in ("value", "low", "high"))])
    head = (
        f"{summary['planner']} ({', '.join(summary['inputs'])}), protocol {summary['protocol']}, goal "
        f"{summary['goal']}, controller on {summary['controller_pose']} poses, latency {summary['latency_steps']}"
    )
    counts = f"{summary['episodes']} episodes in {summary['scenes']} scenes, endings {_counts(summary['endings'])}"
    refused = f"; refused {_counts(summary['refused'])}" if summary["refused"] else ""
    return f"{head}\n{counts}{refused}\n{aligned(rows, right=[1, 2, 3])}"


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "none"


def _agent_config(planner: str, words: object) -> Any:
    if planner != AGENT:
        if words is not None:
            raise ConfigError(f"settings of the agent belong to --planner {AGENT}, found --planner {planner}")
        return None
    from wsm_model.agent.config import AgentConfig

    return build_config(AgentConfig, words or {}, AGENT)  # type: ignore[arg-type]
