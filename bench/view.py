"""`wsm view` over a release of as many clips as the paper has trajectories: start, first page, filters, memory.

The release is generated, without shards: an index of 85,124 clips and eight scores of each. The command runs as a
process of its own, and is asked over HTTP what its page asks for. Goals: first page in 1 s, a filter in 0.2 s, 500 MB.
Run as `python bench/view.py`.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlencode

import httpx
import numpy as np
from generated_index import generate_release
from reporting import machine, machine_line, table, write_results

from wsm_data.access.release import open_release
from wsm_data.curation.path_outline import PATH_POINTS, Outlines
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable, write_scores
from wsm_data.shards.names import SCORES_NAME

CLIPS = 85_124
SCORES = ("path_length_m", "detour_ratio", "turning_total_rad", "clearance_least_m", "passage_narrowest_m")
SCORES += ("dead_end_share", "map_unknown_share", "texture_ratio")
STARTS, ROUNDS = 3, 10
FILTERS: dict[str, dict[str, str]] = {
    "all, by key": {},
    "one split": {"is.split": "test"},
    "one group, by a score": {"is.group": "hssd_zed", "sort": "detour_ratio", "descending": "1"},
    "limits on two scores": {"min.detour_ratio": "0.2", "max.clearance_least_m": "0.5", "sort": "clearance_least_m"},
    "part of the key": {"text": "SCENE_0001"},
    "by split, last page": {"sort": "split", "offset": str(CLIPS - 60)},
    "all of these": {"text": "scene_00", "is.camera": "zed", "min.texture_ratio": "0.1", "sort": "dead_end_share"},
}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        release = Path(folder) / "release"
        generate_release(release, CLIPS)
        _write_scores(release)
        runs = [_measure(release) for _ in range(STARTS)]
    record = {
        "machine": machine("starlette", "uvicorn", "pyarrow", "numpy"),
        "clips": CLIPS,
        "load": os.getloadavg()[0],
        "runs": runs,
    }
    write_results("view", record, _page(record))


def _write_scores(folder: Path) -> None:
    rng, release = np.random.default_rng(0), open_release(folder)
    infos = [ScorerInfo(name=name, unit="", direction=Direction.HIGHER, summary="generated") for name in SCORES]
    scores = ScoreTable(
        release_digest=release.digest,
        scorers=tuple(infos),
        keys=release.index.columns(["key"])["key"].combine_chunks(),
        columns={name: rng.random(CLIPS) for name in SCORES},
    )
    outlines = Outlines(xy_m=np.zeros((CLIPS, PATH_POINTS, 2), np.float32), floor_z_m=np.zeros(CLIPS, np.float32))
    write_scores(folder / SCORES_NAME, scores, outlines)


def _measure(release: Path) -> dict[str, object]:
    """One start of the command, its first page, and every filter in turn, round by round."""
    start_s = time.perf_counter()
    command = [sys.executable, "-u", "-m", "pipelines.cli", "view", str(release), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            address = process.stdout.readline().split()[1]
            ready_s = time.perf_counter() - start_s
            with httpx.Client(base_url=address, timeout=60) as client:
                begun_s = _cpu_s(process.pid)
                first_s = _timed(lambda: _first_page(client))
                first_cpu_s = _cpu_s(process.pid) - begun_s
                seconds: dict[str, list[float]] = {name: [] for name in FILTERS}
                begun_s = _cpu_s(process.pid)
                for _ in range(ROUNDS):
                    for name, words in FILTERS.items():
                        seconds[name].append(_timed(lambda words=words: _clips(client, words)))
                filter_cpu_s = (_cpu_s(process.pid) - begun_s) / (ROUNDS * len(FILTERS))
                found = {name: _clips(client, words)["total"] for name, words in FILTERS.items()}
            peak_mb = _peak_mb(process.pid)
        finally:
            process.terminate()
    times = {"ready_s": ready_s, "first_s": first_s, "first_cpu_s": first_cpu_s, "filter_cpu_s": filter_cpu_s}
    return {**times, "seconds": seconds, "found": found, "peak_mb": peak_mb}


def _first_page(client: httpx.Client) -> None:
    """What a browser asks for until the first page stands, but its thumbnails."""
    for path in ("/", "/static/browser.css", "/static/page.js", "/static/grid.js", "/api/about"):
        client.get(path).raise_for_status()
    _clips(client, {})


def _clips(client: httpx.Client, words: dict[str, str]) -> dict:
    return client.get(f"/api/clips?{urlencode({'limit': '60', **words})}").raise_for_status().json()


def _timed(action: Callable[[], object]) -> float:
    start_s = time.perf_counter()
    action()
    return time.perf_counter() - start_s


def _cpu_s(pid: int) -> float:
    """Processor time of the server so far, all its threads, s; it does not count the time others hold the cores."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _peak_mb(pid: int) -> float:
    """Largest resident memory of the server so far, mapped files included."""
    [line] = [line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmHWM")]
    return int(line.split()[1]) * 1024 / 1e6


def _page(record: dict) -> list[str]:
    runs = record["runs"]
    rows = [
        ["from the command to its address, imports included", _spread([run["ready_s"] for run in runs], 1, "s"), ""],
        ["first page after that", _spread([run["first_s"] for run in runs], 1, "s"), "1 s"],
        ["processor time of that", _spread([run["first_cpu_s"] for run in runs], 1, "s"), ""],
        ["processor time of a filter, mean", _spread([run["filter_cpu_s"] for run in runs], 1000, "ms"), ""],
        ["largest memory", _spread([run["peak_mb"] for run in runs], 1, "MB"), "500 MB"],
    ]
    for name in FILTERS:
        found = f"{runs[0]['found'][name]:,} clips"
        every = [seconds for run in runs for seconds in run["seconds"][name]]
        rows.append([f"filter: {name} ({found})", _spread(every, 1000, "ms"), "200 ms"])
    return [
        f"# `wsm view` over {CLIPS:,} clips",
        "",
        *__doc__.splitlines()[2:],
        "",
        f"Machine: {machine_line(record['machine'])} It was busy: {record['load']:.0f} processes on average. "
        f"{STARTS} starts, {ROUNDS} rounds of the filters in each; medians, least and most in brackets. Thumbnails are "
        "left out: the release has no shards.",
        "",
        *table(["what", "measured", "goal"], rows),
    ]


def _spread(values: list[float], factor: float, unit: str) -> str:
    middle, least, most = (one * factor for one in (statistics.median(values), min(values), max(values)))
    digits = 2 if unit == "s" else 0
    return f"{middle:.{digits}f} {unit} ({least:.{digits}f} to {most:.{digits}f})"


if __name__ == "__main__":
    main()
