"""What post-training on the hard tenth changes: `wsm score`, `wsm select`, `wsm posttrain`, and a page.

The queries that are measured are of homes that neither training nor post-training saw; both policies begin their dreams
from the same noise. Run as `python bench/posttraining.py` after bench/learning.py, whose model and release are taken
unless others are named; a run that was cut short goes on.
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path

from reporting import RESULTS, machine, machine_line, table, write_results

WORK = Path(__file__).parents[1] / "runs" / "bench_posttraining"
LEARNED = Path(__file__).parents[1] / "runs" / "bench_learning"
SETTINGS = Path(__file__).with_suffix(".toml")
MEASURES = ("mean_reward", "unsafe_share", "success_rate")


def wsm(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "pipelines.cli", *words], check=True)


def interval(one: dict[str, float]) -> str:
    return f"{one['value']:.3f} [{one['low']:.3f}, {one['high']:.3f}]"


def page(found: dict, setup: dict[str, object]) -> list[str]:
    rows = [
        [measure, *(interval(found[name][measure]) for name in ("before", "after", "difference"))]
        for measure in MEASURES
    ]
    return [
        "# What post-training on the hard tenth changes",
        "",
        f"{found['steps']} steps of `wsm posttrain` with `bench/posttraining.toml` in {found['minutes']:.0f} minutes, "
        f"on what `wsm select` chose. {found['queries']} queries of {found['scenes']} homes that were never seen, "
        f"{found['dreams']} dreams each; means of homes' means with 95 % intervals, a bootstrap over homes.",
        "",
        *table(["measure", "before", "after", "difference"], rows),
        "",
        "`mean_reward` is s exp(-C / T) before it is divided within a group, `unsafe_share` the share of dreams whose "
        "footprint leaves free space, `success_rate` the share that is safe and keeps the expert's pace "
        "(docs/posttraining.md).",
        "",
        "![curves](posttraining_curves.png)",
        "",
        "![groups of the last step](posttraining_groups.png)",
        "",
        machine_line(setup),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=WORK, help="folder of scores, selection and run")
    parser.add_argument("--model", type=Path, default=LEARNED / "run" / "model")
    parser.add_argument("--release", type=Path, default=LEARNED / "release" / "pack" / "release")
    args = parser.parse_args()
    release, run = str(args.release), args.work / "run"
    wsm("score", release, "--out", str(args.work / "score"), "--quiet")
    wsm("select", release, "--out", str(args.work / "select"), "--set", "name=hard", "--quiet")
    wsm("posttrain", str(args.model), release, "--selection", "hard", "--out", str(run), "--config", str(SETTINGS))
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    found = json.loads((run / "evaluation.json").read_text())
    found |= {"steps": len(lines), "minutes": sum(line["seconds"] for line in lines) / 60}
    RESULTS.mkdir(exist_ok=True)
    shutil.copyfile(run / "curves.png", RESULTS / "posttraining_curves.png")
    shutil.copyfile(max((run / "samples").glob("step-*.png")), RESULTS / "posttraining_groups.png")
    setup = machine("torch", "peft")
    write_results("posttraining", {"machine": setup, **found}, page(found, setup))


if __name__ == "__main__":
    main()
