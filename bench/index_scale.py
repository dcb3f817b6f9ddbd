"""Opening a release, ordering an epoch and finding the first clips, from ten thousand to ten million clips.

The releases are generated, without shards: clips of about 2 MB in shards of 512 MB, random checksums and digests. Every
measurement is a process of its own; imports are left out, except those of joining clips (numba), which the order makes.
Goals at ten million clips: open in 2 s, order in 2 s, all of it within 1.5 GB. Run as `python bench/index_scale.py`.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from generated_index import generate_release
from reporting import machine, machine_line, table, write_results

from wsm_data.loaders.config import Arrangement, OrderConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import EpochOrder, chunk_sizes, order_epoch
from wsm_data.loaders.reading.clip_places import clip_places
from wsm_data.loaders.sources.clips import Sources, open_sources
from wsm_data.shards.names import INDEX_NAME

CLIPS = (10_000, 100_000, 1_000_000, 10_000_000)
ROUNDS = 3
GLOBAL_BATCH = 256
WORLD_SIZE = 8
ORDERS = {
    "shuffled": OrderConfig(global_batch=GLOBAL_BATCH),
    "bucket": OrderConfig(global_batch=GLOBAL_BATCH, arrangement=Arrangement.BUCKET),
    "join": OrderConfig(global_batch=GLOBAL_BATCH, arrangement=Arrangement.JOIN, row_latents=128, pool=256),
}
STEPS = {
    "open_s": "open, digest of the index compared, s",
    "open_gb": "peak memory, GB",
    "order_s": "order of an epoch, s",
    "order_gb": "peak memory, GB",
    "refs_ms": "refs of the first batch, ms",
    "batch_s": "their keys, places and checksums, s",
    "batch_gb": "peak memory, GB",
    "key_s": "one clip by its key, s",
}


def measure(release: str, order: OrderConfig) -> dict[str, float]:
    """Seconds and peak memory of one process, step by step."""
    numbers: dict[str, float] = {}
    sources = _timed(numbers, "open_s", lambda: open_sources([SourceConfig(release=release)]))
    numbers["open_gb"] = _peak_gb()
    epoch_order = _timed(numbers, "order_s", lambda: order_epoch(sources.layouts, order, epoch=0))
    numbers["order_gb"] = _peak_gb()
    refs = _timed(numbers, "refs_ms", lambda: _first_refs(epoch_order))
    numbers["refs_ms"] *= 1000
    _timed(numbers, "batch_s", lambda: _facts(sources, epoch_order, refs))
    numbers["batch_gb"] = _peak_gb()
    [key] = sources.keys(refs[-1:])
    row = _timed(numbers, "key_s", lambda: sources.tables[0].release.index.row(key))
    assert row.key == key
    return numbers


def _first_refs(epoch_order: EpochOrder) -> np.ndarray:
    return np.concatenate(epoch_order.rows(0, WORLD_SIZE // 2, WORLD_SIZE))


def _facts(sources: Sources, epoch_order: EpochOrder, refs: np.ndarray) -> None:
    """What a rank needs of its clips before it reads them."""
    places = clip_places(sources, refs)
    chunk_sizes(refs, epoch_order.config, epoch_order.epoch)
    assert len({place.key for place in places}) == len(refs)


def _timed(numbers: dict[str, float], name: str, action):
    start_s = time.perf_counter()
    result = action()
    numbers[name] = time.perf_counter() - start_s
    return result


def _peak_gb() -> float:
    """Largest resident memory of this process so far, mapped files included."""
    [line] = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")]
    return int(line.split()[1]) * 1024 / 1e9


def _in_a_process(release: Path, order: str) -> dict[str, float]:
    command = [sys.executable, __file__, "--release", str(release), "--order", order]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def _medians(runs: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    return {
        name: {
            "median": statistics.median(run[name] for run in runs),
            "least": min(run[name] for run in runs),
            "most": max(run[name] for run in runs),
        }
        for name in runs[0]
    }


def _measure_size(folder: Path, clips: int) -> dict[str, object]:
    release = folder / f"release_{clips}"
    generate_release(release, clips)
    runs: dict[str, list[dict[str, float]]] = {order: [] for order in ORDERS}
    for _ in range(ROUNDS):
        for order in ORDERS:
            runs[order].append(_in_a_process(release, order))
    index_mb = (release / INDEX_NAME).stat().st_size / 1e6
    for path in release.iterdir():
        path.unlink()
    return {"clips": clips, "index_mb": index_mb, "orders": {order: _medians(runs[order]) for order in ORDERS}}


def _number(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def _cells(sizes: list[dict], order: str, step: str) -> list[str]:
    found = [size["orders"][order][step] for size in sizes]
    cells = [f"{_number(one['median'])} ({_number(one['least'])} to {_number(one['most'])})" for one in found]
    return [*cells, f"{found[-1]['median'] / found[-2]['median']:.1f} x"]


def _page(sizes: list[dict], about: dict[str, object]) -> list[str]:
    header = ["", *(f"{size['clips']:,} clips" for size in sizes), "last tenfold"]
    lines = ["# Opening and ordering, from ten thousand to ten million clips", "", *__doc__.splitlines()[2:], ""]
    lines += [f"Machine: {machine_line(about)} Medians of {ROUNDS} processes, least and most in brackets.", ""]
    for order in ORDERS:
        rows = [["index, MB", *(f"{size['index_mb']:.1f}" for size in sizes), ""]]
        rows += [[name, *_cells(sizes, order, step)] for step, name in STEPS.items()]
        settings = ORDERS[order]
        joined = f", rows of {settings.row_latents} latents" if settings.row_latents else ""
        lines += [
            f"## {order}: global batch {GLOBAL_BATCH}, pool {settings.pool}{joined}",
            "",
            *table(header, rows),
            "",
        ]
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--release", help="measure this release, in this process, and print the numbers")
    parser.add_argument("--order", default="shuffled", choices=ORDERS)
    arguments = parser.parse_args()
    if arguments.release:
        print(json.dumps(measure(arguments.release, ORDERS[arguments.order])))
        return
    with tempfile.TemporaryDirectory() as folder:
        sizes = [_measure_size(Path(folder), clips) for clips in CLIPS]
    about = machine("numpy", "pyarrow", "numba")
    record = {"machine": about, "global_batch": GLOBAL_BATCH, "rounds": ROUNDS, "sizes": sizes}
    write_results("index_scale", record, _page(sizes, about))


if __name__ == "__main__":
    main()
