"""What the model's tiny size learns on this machine: `wsm run tiny`, `wsm train` with bench/learning.toml, and a page.

Homes of the test split are not seen in training. States are estimated as in use, one latent after the other on the
model's own earlier estimates. Beside the model stand a camera that does not move, one that goes on as it truly began
(its speed and heading are given away), the best constant depth map of those very clips, and for dreams the last latent
and the best linear guess from it. Run as `python bench/learning.py`; a run that was cut short goes on. On two quiet
cores it takes two hours.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from reporting import RESULTS, machine, machine_line, table, write_results

WORK = Path(__file__).parents[1] / "runs" / "bench_learning"
SETTINGS = Path(__file__).with_suffix(".toml")
WINDOW = 50
"""Steps over which a curve is averaged at its beginning and at its end."""
GUESSES = ("dream", "copy", "shrunk_copy")
NAMES = ("dream", "copy", "shrunk copy")


def wsm(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "pipelines.cli", *words], check=True)


def summary(run: Path) -> dict[str, Any]:
    """Numbers of the page, from what a finished run wrote."""
    logged = (json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines())
    lines = [line for line in logged if "loss" in line]  # others hold what was measured on held-out clips
    found = json.loads((run / "evaluation.json").read_text())
    states = [clip["states"] for clip in found["clips"]]
    better = [min(one["ate_rmse_zero_motion_m"], one["ate_rmse_constant_velocity_m"]) for one in states]
    return {
        **{name: value for name, value in found.items() if name != "clips"},
        "steps": len(lines),
        "minutes": sum(line["seconds"] for line in lines) / 60,
        "clips": len(states),
        "better_of_both_ate_m": statistics.fmean(better),
        "clips_below_both": sum(one["ate_rmse_unaligned_m"] < limit for one, limit in zip(states, better, strict=True)),
        "curves": {name: ends(lines, name) for name in ("flow", "depth", "pose_absolute", "pose_relative")},
    }


def ends(lines: list[dict[str, float]], name: str) -> list[float]:
    """Mean at the beginning and at the end of training."""
    values = [line[name] for line in lines]
    return [statistics.fmean(values[:WINDOW]), statistics.fmean(values[-WINDOW:])]


def state_rows(found: dict[str, Any]) -> list[list[str]]:
    rows = [
        [
            "camera ATE of a clip, not aligned, m",
            f"{found['ate_rmse_unaligned_m']:.3f}",
            f"zero motion {found['ate_rmse_zero_motion_m']:.3f}, constant velocity "
            f"{found['ate_rmse_constant_velocity_m']:.3f}, the better of both on each clip "
            f"{found['better_of_both_ate_m']:.3f}",
        ],
        ["camera ATE of a clip, Sim(3), m", f"{found['ate_rmse_sim3_m']:.3f}", ""],
    ]
    for label, name in (("AbsRel", "depth_abs_rel"), ("delta_1", "depth_delta1"), ("log RMSE", "depth_log_rmse")):
        rows.append([f"depth, {label}", f"{found[name]:.3f}", f"best constant map {found[f'{name}_constant_map']:.3f}"])
    return rows


def dream_rows(found: dict[str, Any]) -> list[list[str]]:
    return [
        [f"+{ahead + 1}", *(f"{value:.2f}" for value in values)]
        for ahead, values in enumerate(
            zip(
                *(found[f"{name}_psnr_db"] for name in GUESSES),
                *(found[f"{name}_ssim"] for name in GUESSES),
                strict=True,
            )
        )
    ]


def page(found: dict[str, Any], setup: dict[str, object]) -> list[str]:
    flow = found["flow"]
    below = 100 * (1 - found["depth_abs_rel"] / found["depth_abs_rel_constant_map"])
    strict = 100 * (1 - found["ate_rmse_unaligned_m"] / found["better_of_both_ate_m"])
    return [
        "# What the tiny size learns",
        "",
        f"`wsm run tiny`, then `wsm train` with `bench/learning.toml`: {found['steps']} steps in "
        f"{found['minutes']:.0f} minutes. Means over {found['clips']} clips of homes that were never seen in training.",
        "",
        *table(["states on held-out homes", "model", "beside it"], state_rows(found)),
        "",
        f"The depth error is {below:.0f} % below the best constant map. The camera error is {strict:.0f} % below the "
        "better of zero motion and constant velocity on each clip, and below both on "
        f"{found['clips_below_both']} of {found['clips']} clips.",
        "",
        "Dreams of a chunk after the first half of each clip: decoded frames, by the latent ahead.",
        "",
        *table(
            ["latent", *(f"{name}, PSNR dB" for name in NAMES), *(f"{name}, SSIM" for name in NAMES)],
            dream_rows(found),
        ),
        "",
        f"Flow-matching loss: {flow['model']:.3f}; copy of the last latent {flow['copy']:.3f}, unconditional "
        f"{flow['unconditional']:.3f}.",
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
