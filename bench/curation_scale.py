"""What curation costs at scale: geometry scores of 85,000 trajectories, and `wsm select` of up to ten million clips.

Scores are timed one trajectory after another, on one core, over homes with and without planted difficulties
(bench/planted_homes.py), in a process of its own, and the total is extrapolated from their mean. `wsm select` runs as
the command does, in a process that starts cold, on a generated index and generated scores: it opens the release,
compares digests, reads scores and outlines, rates, leaves out near-duplicates, writes the selection and installs it.
Peak memory is the greatest resident set of a process; that of scoring includes the making of the homes. Run as
`python bench/curation_scale.py`.
"""

import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pyarrow as pa
from generated_index import generate_release
from planted_homes import KINDS, planted_pair
from reporting import machine, machine_line, table, write_results

from wsm_data.access.release import open_release
from wsm_data.curation.path_outline import PATH_POINTS, Outlines
from wsm_data.curation.quotas import column_codes
from wsm_data.curation.rule import GEOMETRY_WEIGHTS
from wsm_data.curation.score_clip import CLIP_SCORES, score_trajectory
from wsm_data.curation.scorers.registry import GEOMETRY_SCORERS
from wsm_data.curation.scores_table import ScoreTable, write_scores
from wsm_data.files.digest import sha256_file
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.selection import read_selection

TRAJECTORIES = 85_000
SAMPLED_CASES = 6  # of each kind, both twins
SEED = 7
SELECTED = {20_000: 5, 1_000_000: 3, 10_000_000: 2}  # clips: rounds
GOAL_S, GOAL_GB = 30.0, 4.0
SCENE_M, FLOORS, FLOOR_M = 12.0, 2, 2.8
REPEATED_EVERY, BESIDE_M = 10, 0.05
SELECT = (sys.executable, "-c", "from pipelines.cli import app; app()", "select")


def main() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        scoring = pool.submit(time_scores).result()
    selecting = {}
    for clips, rounds in SELECTED.items():
        with tempfile.TemporaryDirectory() as folder:
            selecting[clips] = time_select(Path(folder), clips, rounds)
    report(scoring, selecting)


def time_scores() -> dict[str, float]:
    """Seconds that all geometry scores of a trajectory take, and the peak memory of the process that calls this.

    The first pair of a kind compiles and is not counted.
    """
    seconds, frames = [], []
    for kind in KINDS:
        for case in range(SAMPLED_CASES + 1):
            for twin in planted_pair(kind, case, SEED):
                started = time.perf_counter()
                score_trajectory(twin.trajectory, kind)
                if case:
                    seconds.append(time.perf_counter() - started)
                    frames.append(len(twin.trajectory.T_world_camera))
    quartiles = statistics.quantiles(seconds, n=4)
    return {
        "trajectories": len(seconds),
        "mean frames": statistics.fmean(frames),
        "mean s": statistics.fmean(seconds),
        "standard error s": statistics.stdev(seconds) / len(seconds) ** 0.5,
        "first quartile s": quartiles[0],
        "third quartile s": quartiles[2],
        "peak GB": gigabytes(resource.getrusage(resource.RUSAGE_SELF)),
    }


def time_select(folder: Path, clips: int, rounds: int) -> dict[str, object]:
    """Wall times and peak memory of `wsm select`, cold processes; every round must write the same bytes."""
    release = folder / "release"
    generator = multiprocessing.get_context("spawn").Process(target=generate, args=(release, clips))
    generator.start()  # a child's peak counts from that of its parent: this process must stay small
    generator.join()
    assert generator.exitcode == 0
    seconds, peaks, digests = [], [], set()
    for number in range(rounds):
        started = time.perf_counter()
        process = subprocess.Popen(
            [*SELECT, str(release), "-q", "--out", str(folder / f"round{number}")], stdout=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        seconds.append(time.perf_counter() - started)
        peaks.append(gigabytes(usage))
        digests.add(sha256_file(folder / f"round{number}" / "hard.parquet"))
    assert len(digests) == 1, "the same command must write the same bytes"
    chosen = read_selection(release, "hard", release_digest(open_release(release).manifest))
    return {
        "rounds": rounds,
        "chosen": len(chosen),
        "near-duplicates": chosen.rule["clips"]["near-duplicates left out"],
        "median s": statistics.median(seconds),
        "least s": min(seconds),
        "most s": max(seconds),
        "peak GB": max(peaks),
    }


def generate(release: Path, clips: int) -> None:
    generate_release(release, clips)
    generate_scores(release, clips)


def gigabytes(usage: resource.struct_rusage) -> float:
    """Greatest resident set, GB; Linux counts it in KiB."""
    return usage.ru_maxrss * 1024 / 1e9


def generate_scores(release: Path, clips: int) -> None:
    """All scores of all clips, skewed as lengths and detours are, and paths with a bend on two floors of 12 m.

    In every scene a tenth of the paths repeat another one of it, a few centimetres beside.
    """
    rng = np.random.default_rng(clips)
    opened = open_release(release)
    index = opened.index.columns(["key", "physical_scene"])
    keys = index["key"]
    columns = {one.name: rng.gamma(2.0, 1.0, clips) for one in CLIP_SCORES}
    columns["goal_reachable"] = (rng.random(clips) > 0.001).astype(np.float64)
    scores = ScoreTable(
        release_digest=release_digest(opened.manifest),
        scorers=CLIP_SCORES,
        keys=pa.concat_arrays(keys.chunks),
        columns=columns,
    )
    xy_m = np.empty((clips, PATH_POINTS, 2), np.float32)
    along = np.linspace(0, 1, PATH_POINTS, dtype=np.float32)[:, None]
    for rows in slices(clips, 1 << 20):
        count = len(range(clips)[rows])
        start, bend, end = (rng.uniform(0, SCENE_M, (count, 1, 2)).astype(np.float32) for _ in range(3))
        xy_m[rows] = np.where(along < 0.5, start + 2 * along * (bend - start), bend + (2 * along - 1) * (end - bend))
    by_scene = np.argsort(column_codes(index["physical_scene"])[1], kind="stable")
    first, again = by_scene[:-1:REPEATED_EVERY], by_scene[1::REPEATED_EVERY]
    xy_m[again] = xy_m[first] + rng.normal(0, BESIDE_M, (len(first), 1, 2)).astype(np.float32)
    floor_z_m = (FLOOR_M * rng.integers(0, FLOORS, clips)).astype(np.float32)
    floor_z_m[again] = floor_z_m[first]
    write_scores(release / SCORES_NAME, scores, Outlines(xy_m=xy_m, floor_z_m=floor_z_m))


def slices(count: int, size: int) -> Iterator[slice]:
    return (slice(first, first + size) for first in range(0, count, size))


def report(scoring: dict[str, float], selecting: dict[int, dict[str, object]]) -> None:
    hours = {name: scoring[name] * TRAJECTORIES / 3600 for name in ("mean s", "standard error s")}
    record = {
        "machine": machine("numpy", "numba", "pyarrow", "scipy"),
        "scoring": scoring,
        "scoring, hours of one core for 85,000": hours,
        "selecting": {str(clips): one for clips, one in selecting.items()},
    }
    first, third = (1000 * scoring[f"{name} quartile s"] for name in ("first", "third"))
    lines = [
        "# Curation at scale",
        "",
        f"All {len(GEOMETRY_SCORERS)} geometry scores of one trajectory take {1000 * scoring['mean s']:.0f} ms on one "
        f"core (mean of {scoring['trajectories']}, quartiles {first:.0f} and {third:.0f} ms, "
        f"{scoring['mean frames']:.0f} frames in the mean). Extrapolated, {TRAJECTORIES:,} take {hours['mean s']:.2f} "
        f"hours of one core (standard error {hours['standard error s']:.2f}); reading the clips is not counted. The "
        f"process took {scoring['peak GB']:.2f} GB at its peak, the making of the homes included; it scores one "
        "trajectory at a time, so their number does not matter.",
        "",
        f"`wsm select RELEASE` as a cold process: {len(CLIP_SCORES)} scores a clip in the file, "
        f"{len(GEOMETRY_WEIGHTS)} in the rule, the hardest 10 % of the training split, near-duplicates within 0.5 m "
        "left out. Every round wrote the same bytes.",
        "",
        *table(["clips", "chosen", "near-duplicates", "time", "peak memory"], [row(*one) for one in selecting.items()]),
        "",
        verdict(selecting[max(SELECTED)]),
        "",
        machine_line(record["machine"]),
    ]
    write_results("curation_scale", record, lines)


def row(clips: int, one: dict[str, object]) -> list[str]:
    spread = f"{one['median s']:.1f} s ({one['least s']:.1f} to {one['most s']:.1f}, {one['rounds']} rounds)"
    return [f"{clips:,}", f"{one['chosen']:,}", f"{one['near-duplicates']:,}", spread, f"{one['peak GB']:.2f} GB"]


def verdict(largest: dict[str, object]) -> str:
    met = largest["median s"] < GOAL_S and largest["peak GB"] < GOAL_GB
    goal = f"under {GOAL_S:.0f} s and {GOAL_GB:.0f} GB"
    return f"Goal for {max(SELECTED):,} clips: {goal}: {'met' if met else 'missed'}."


if __name__ == "__main__":
    main()
