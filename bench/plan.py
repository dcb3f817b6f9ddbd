"""What `wsm plan` says from a sample of 5 % against the run that follows: bytes, and time.

The source is of generated homes in archives, 60 of them, with other numbers of frames than any that the plan was tried
on. Each round makes the plan and then the run, one after the other; both are processes of their own with one worker.
A plan speaks of time on the wall, and on a machine that others use that says as much of them as of us. So the second
line of time is of the processor: the planned hours times the share of its time that the sample had a processor, against
the processor time of the run, its start included. Goals: bytes within 5 %, time within 25 %. Run as
`python bench/plan.py [SOURCE]`; SOURCE is generated where it is not there.
"""

import json
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from reporting import machine, machine_line, table, write_results

from pipelines.artifacts.plan_file import write_plan
from pipelines.running.options import RunOptions, StageRequest
from wsm_data.files.folder_bytes import folder_bytes
from wsm_data.files.json_values import to_json
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

ROUNDS = 3
SCENES = 60
SYNTH = SynthConfig(
    seed=11,
    scenes=SCENES,
    trajectories=3,
    cameras=("d435i",),
    min_frames=12,
    max_frames=60,
    floor_spacing_m=0.04,
    surface_spacing_m=0.08,
)
SETTINGS = ("--set", "index.dataset=synthetic", "--workers", "1")


def process(*words: object) -> tuple[str, float, float]:
    """What a program prints, its seconds on the wall and those of the processor."""
    command = [sys.executable, *map(str, words)]
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return said, time.perf_counter() - began, spent


def plan_in_this_process(source: str, run: str) -> None:
    """Make a plan as `wsm plan` does, and print it with the share of its time that the sample had a processor."""
    from pipelines.operations.planning import plan

    ran, spent = plan.run_sample, []

    def timed(*arguments: object) -> object:
        began = time.perf_counter(), time.process_time()
        try:
            return ran(*arguments)
        finally:
            spent.append((time.process_time() - began[1]) / (time.perf_counter() - began[0]))

    plan.run_sample = timed
    options = RunOptions(workers=1)
    words = ("index.dataset=synthetic",)
    made = plan.make_plan(source, "interndata", StageRequest(assignments=words, options=options), 0.05, None)
    write_plan(Path(run), made)
    print(json.dumps({"plan": to_json(made), "processor_share": spent[-1]}))


def measure(source: Path, run: Path) -> dict[str, object]:
    run.mkdir()
    said, plan_wall_s, plan_cpu_s = process(__file__, "--plan", source, run)
    plan = json.loads(said)
    plan["plan"].pop("source")  # a path of this machine
    words = ("run", "interndata", "--set", f"source={source}", *SETTINGS, "--quiet", "--out", run)
    _, run_wall_s, run_cpu_s = process("-m", "pipelines.cli", *words)
    release, whole = folder_bytes(run / "pack/release"), folder_bytes(run)
    shutil.rmtree(run)
    return {
        **plan,
        "plan_wall_s": plan_wall_s,
        "plan_cpu_s": plan_cpu_s,
        "run_wall_s": run_wall_s,
        "run_cpu_s": run_cpu_s,
        "release_bytes": release,
        "run_folder_bytes": whole,
    }


def rows_of(found: dict[str, object]) -> list[list[str]]:
    plan = found["plan"]
    seconds = {key: value * 3600 for key, value in plan["hours"].items()}
    return [
        [
            "release, MB",
            *_row({key: one / 1e6 for key, one in plan["bytes_out"].items()}, found["release_bytes"] / 1e6),
        ],
        [
            "run folder, MB",
            *_row({key: one / 1e6 for key, one in plan["peak_disk_bytes"].items()}, found["run_folder_bytes"] / 1e6),
        ],
        ["time on the wall, s", *_row(seconds, found["run_wall_s"])],
        [
            "time of the processor, s",
            *_row({key: one * found["processor_share"] for key, one in seconds.items()}, found["run_cpu_s"]),
        ],
    ]


def _row(planned: dict[str, float], actual: float) -> list[str]:
    bounds = f"{planned['value']:.1f} ({planned['low']:.1f} to {planned['high']:.1f})"
    return [bounds, f"{actual:.1f}", f"{planned['value'] / actual - 1:+.1%}"]


def main() -> None:
    if sys.argv[1:2] == ["--plan"]:
        plan_in_this_process(*sys.argv[2:])
        return
    with tempfile.TemporaryDirectory() as folder:
        source = Path(sys.argv[1] if len(sys.argv) > 1 else Path(folder) / "source")
        for scene in () if source.exists() else range(SCENES):
            write_scene(source, scene, "d435i", SYNTH)
        rounds = [measure(source, Path(folder) / "run") for _ in range(ROUNDS)]
    first = rounds[0]["plan"]
    errors = {
        "release_bytes": [one["plan"]["bytes_out"]["value"] / one["release_bytes"] - 1 for one in rounds],
        "run_folder_bytes": [one["plan"]["peak_disk_bytes"]["value"] / one["run_folder_bytes"] - 1 for one in rounds],
        "processor": [
            one["plan"]["hours"]["value"] * 3600 * one["processor_share"] / one["run_cpu_s"] - 1 for one in rounds
        ],
        "wall": [one["plan"]["hours"]["value"] * 3600 / one["run_wall_s"] - 1 for one in rounds],
    }
    setup = machine("numpy", "scipy")
    lines = [
        "# A plan from a sample against the run",
        "",
        *__doc__.splitlines()[2:],
        "",
        f"{first['containers']} archives with {first['bytes_in']:,} bytes, of which {first['sampled_containers']} with "
        f"{first['sampled_bytes'] / first['bytes_in']:.1%} of the bytes were run.",
        "",
    ]
    for number, one in enumerate(rounds, 1):
        lines += [f"Round {number}: the plan took {one['plan_wall_s']:.0f} s ({one['plan_cpu_s']:.0f} s of processor "]
        lines[-1] += f"time), the run {one['run_wall_s']:.0f} s ({one['run_cpu_s']:.0f} s of processor time)."
        lines += ["", *table(["what", "planned (bounds of 90 %)", "came", "planned against it"], rows_of(one)), ""]
    wall, spent = (statistics.median(errors[name]) for name in ("wall", "processor"))
    lines += [f"Time: median of the rounds {wall:+.1%} on the wall, {spent:+.1%} of the processor.", ""]
    lines += [machine_line(setup)]
    write_results("plan", {"machine": setup, "rounds": rounds, "errors": errors}, lines)


if __name__ == "__main__":
    main()
