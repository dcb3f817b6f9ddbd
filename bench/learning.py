"""What the model's tiny size learns on this machine: `wsm run tiny`, `wsm train` with bench/learning.toml, and a page.

Homes of the test split are not seen in training. States are estimated as in use, one latent after the other on the
model's own earlier estimates. Beside the model stand a camera that does not move, one that goes on as it truly began
(its speed and heading are given away), the mean of the training depth, and two guesses of the flow that know nothing
of what is to come. Run as `python bench/learning.py`; a run that was cut short goes on. Takes an hour on two cores.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

from reporting import RESULTS, machine, machine_line, table, write_results

WORK = Path(__file__).parents[1] / "runs" / "bench_learning"
SETTINGS = Path(__file__).with_suffix(".toml")
WINDOW = 50
"""Steps over which a curve is averaged at its beginning and at its end."""


def wsm(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "pipelines.cli", *words], check=True)


def summary(run: Path) -> dict[str, object]:
    """Numbers of the page, from what a finished run wrote."""
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    found = json.loads((run / "evaluation.json").read_text())
    clips = found["clips"]
    better = [min(clip["ate_rmse_zero_motion_m"], clip["ate_rmse_constant_velocity_m"]) for clip in clips]
    return {
        "steps": len(lines),
        "minutes": sum(line["seconds"] for line in lines) / 60,
        "clips": len(clips),
        "ate_rmse_unaligned_m": mean(clips, "ate_rmse_unaligned_m"),
        "ate_rmse_zero_motion_m": mean(clips, "ate_rmse_zero_motion_m"),
        "ate_rmse_constant_velocity_m": mean(clips, "ate_rmse_constant_velocity_m"),
        "better_of_both_ate_m": statistics.fmean(better),
        "clips_below_both": sum(
            clip["ate_rmse_unaligned_m"] < limit for clip, limit in zip(clips, better, strict=True)
        ),
        "depth_mse": mean(clips, "depth_mse"),
        "mean_depth_mse": mean(clips, "mean_depth_mse"),
        "flow": found["flow"],
        "curves": {name: ends(lines, name) for name in ("flow", "depth", "pose_absolute", "pose_relative")},
    }


def mean(clips: list[dict[str, float]], name: str) -> float:
    return statistics.fmean(clip[name] for clip in clips)


def ends(lines: list[dict[str, float]], name: str) -> list[float]:
    """Mean at the beginning and at the end of training."""
    values = [line[name] for line in lines]
    return [statistics.fmean(values[:WINDOW]), statistics.fmean(values[-WINDOW:])]


def page(found: dict, setup: dict[str, object]) -> list[str]:
    flow, best = found["flow"], min(found["ate_rmse_zero_motion_m"], found["ate_rmse_constant_velocity_m"])
    below = 100 * (1 - found["ate_rmse_unaligned_m"] / best)
    strict = 100 * (1 - found["ate_rmse_unaligned_m"] / found["better_of_both_ate_m"])
    depth_below = 100 * (1 - found["depth_mse"] / found["mean_depth_mse"])
    return [
        "# What the tiny size learns",
        "",
        f"`wsm run tiny`, then `wsm train` with `bench/learning.toml`: {found['steps']} steps in "
        f"{found['minutes']:.0f} minutes. Means over {found['clips']} clips of homes that were never seen in training.",
        "",
        *table(
            ["on held-out homes", "model", "beside it"],
            [
                [
                    "camera ATE of a clip, not aligned, m",
                    f"{found['ate_rmse_unaligned_m']:.3f}",
                    f"zero motion {found['ate_rmse_zero_motion_m']:.3f}, constant velocity "
                    f"{found['ate_rmse_constant_velocity_m']:.3f}, the better of both on each clip "
                    f"{found['better_of_both_ate_m']:.3f}",
                ],
                [
                    "squared error of standardised depth latents",
                    f"{found['depth_mse']:.3f}",
                    f"training mean {found['mean_depth_mse']:.3f}",
                ],
                [
                    "flow-matching loss",
                    f"{flow['model']:.3f}",
                    f"copy of the last latent {flow['copy']:.3f}, unconditional {flow['unconditional']:.3f}",
                ],
            ],
        ),
        "",
        f"The camera error is {below:.0f} % below the better of zero motion and constant velocity, {strict:.0f} % "
        f"below the better of both on each clip, and below both on {found['clips_below_both']} of {found['clips']} "
        f"clips. The depth error is {depth_below:.1f} % below the training mean.",
        "",
        f"## Training losses, means of the first and of the last {WINDOW} steps",
        "",
        *table(
            ["part", "first", "last"],
            [[name, f"{first:.3f}", f"{last:.3f}"] for name, (first, last) in found["curves"].items()],
        ),
        "",
        "![curves](learning_curves.png)",
        "",
        "A held-out clip after the last step: dreams and estimates beside the truth.",
        "",
        "![dream](learning_dream.png)",
        "",
        machine_line(setup),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=WORK, help="folder of the release and of the run")
    work = parser.parse_args().work
    wsm("run", "tiny", "--out", str(work / "release"))
    release, run = work / "release" / "pack" / "release", work / "run"
    wsm("train", str(release), "--out", str(run), "--config", str(SETTINGS))
    RESULTS.mkdir(exist_ok=True)
    shutil.copyfile(run / "curves.png", RESULTS / "learning_curves.png")
    shutil.copyfile(max((run / "samples").glob("step-*.png")), RESULTS / "learning_dream.png")
    found, setup = summary(run), machine("torch")
    write_results("learning", {"machine": setup, **found}, page(found, setup))


if __name__ == "__main__":
    main()
