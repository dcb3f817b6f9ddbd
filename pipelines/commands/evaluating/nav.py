"""`wsm eval nav`: how well a planner gets to its goals in closed loop."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Out, Quiet, Workers


class NavProtocol(StrEnum):
    """Whose endings and success count."""

    PAPER = "paper"
    NAVDP_2025_12 = "navdp-2025-12"
    NAVDP_2026_06 = "navdp-2026-06"


class NavGoal(StrEnum):
    """Whether the goal is given once, or recomputed from the true pose for each observation."""

    FIXED = "fixed"
    ORACLE = "oracle"


class ControllerPose(StrEnum):
    """By whose poses the controller tracks a path."""

    TRUE = "true"
    ESTIMATED = "estimated"


def nav(
    out: Out,
    planner: Annotated[
        str,
        typer.Option(
            "--planner",
            help="oracle, straight-line, reactive, map-and-plan, map-and-plan-estimated, agent, or a URL.",
        ),
    ],
    model: Annotated[Path | None, typer.Option("--model", help="Folder of the model of --planner agent.")] = None,
    codec_weights: Annotated[str, typer.Option("--codec-weights", help="Folder of the codec's weights, if any.")] = "",
    world: Annotated[
        str, typer.Option("--world", help="homes, miniworld, or a folder of SCENE/pointgoal_start_goal_pairs.npy.")
    ] = "homes",
    episodes: Annotated[int, typer.Option("--episodes", min=1, help="Episodes in all; more go on in --out.")] = 50,
    episodes_per_scene: Annotated[int, typer.Option("--episodes-per-scene", min=1, help="Episodes a scene.")] = 5,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Of scenes and episodes; another than the training data's.")
    ] = 1000,
    protocol: Annotated[NavProtocol, typer.Option("--protocol", help="Whose endings and success.")] = NavProtocol.PAPER,
    goal: Annotated[NavGoal, typer.Option("--goal", help="Given once, or by the true pose each time.")] = NavGoal.FIXED,
    controller_pose: Annotated[
        ControllerPose, typer.Option("--controller-pose", help="Poses that the controller tracks by.")
    ] = ControllerPose.TRUE,
    latency: Annotated[
        int, typer.Option("--latency", min=0, help="Control steps from an observation to its answer; 0: synchronous.")
    ] = 1,
    films: Annotated[int, typer.Option("--films", min=0, help="Write films of the first so many episodes.")] = 0,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", "-s", help="One setting: sim.KEY=value or agent.KEY=value. Repeatable.")
    ] = None,
    workers: Workers = 1,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show settings and scenes; write nothing.")] = False,
    quiet: Quiet = False,
) -> None:
    """Drive through episodes and write their table, means with intervals, maps and films."""
    from pipelines.operations.evaluating.nav import eval_nav, nav_config

    sim = {
        "protocol": protocol.value,
        "goal": {NavGoal.FIXED: "start", NavGoal.ORACLE: "current"}[goal],
        "estimated_controller_pose": controller_pose is ControllerPose.ESTIMATED,
        "latency_steps": latency,
    }
    config = nav_config(planner, model, codec_weights, world, seed, episodes_per_scene, sim, assignments or [])
    eval_nav(config, out, episodes=episodes, workers=workers, films=films, dry_run=dry_run, quiet=quiet)


COMMAND = Command(
    name="nav", summary="Success, SPL and collisions of a planner in closed loop, with intervals.", call=nav
)
