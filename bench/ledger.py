"""What a record of the ledger costs, beside other ways to keep one, and beside the least that a step takes.

Run: python bench/ledger.py
"""

import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from reporting import machine, machine_line, table, write_results

from wsm_data.files.jsonlines import canonical_json
from wsm_data.loaders.ledger.writer import LedgerWriter

CLIPS = 8  # of a rank's step
STEP_BYTES = CLIPS * 2_000_000  # latents of a median clip
ROUNDS, RECORDS, FLUSHED = 15, 2000, 20
REFS = np.arange(CLIPS, dtype=np.int64) * 1_000_003


def seconds_each(count: int, work: Callable[[int], object]) -> float:
    start = time.perf_counter()
    for number in range(count):
        work(number)
    return (time.perf_counter() - start) / count


def measure(folder: Path) -> dict[str, list[float]]:
    """Seconds of one record or one copy in each round; all contestants take part in every round."""
    seconds: dict[str, list[float]] = {name: [] for name in ("ledger", "write", "flushed", "copy")}
    source, target = np.ones(STEP_BYTES, np.uint8), np.empty(STEP_BYTES, np.uint8)
    data = canonical_json({"epoch": 0, "step": RECORDS, "refs": REFS.tolist()}).encode() + bytes(28)  # and a checksum
    with (
        LedgerWriter(folder / "ledger", {}, 0, 1) as ledger,
        (folder / "bare").open("wb", buffering=0) as bare,
        (folder / "flushed.jsonl").open("wb", buffering=0) as flushed,
    ):

        def write_flushed(step: int) -> None:
            flushed.write(canonical_json({"epoch": 0, "step": step, "refs": REFS.tolist()}).encode() + b"\n")
            os.fsync(flushed.fileno())

        for epoch in range(ROUNDS):
            ledger.begin(epoch, 0, RECORDS)
            seconds["ledger"].append(seconds_each(RECORDS, lambda step, epoch=epoch: ledger.record(epoch, step, REFS)))
            seconds["write"].append(seconds_each(RECORDS, lambda _: bare.write(data)))
            seconds["flushed"].append(seconds_each(FLUSHED, write_flushed))
            seconds["copy"].append(seconds_each(FLUSHED, lambda _: np.copyto(target, source)))
    return seconds


def page(seconds: dict[str, list[float]], setup: dict[str, object]) -> list[str]:
    names = {
        "ledger": "a record of the ledger",
        "write": "its bytes alone, one write to the system",
        "flushed": "a JSON line, flushed to disk",
        "copy": f"copy of {STEP_BYTES / 1e6:.0f} MB in memory",
    }
    rows = []
    for name, words in names.items():
        microseconds = sorted(1e6 * value for value in seconds[name])
        ratios = [mine / other for mine, other in zip(seconds["ledger"], seconds[name], strict=True)]
        spread = f"{statistics.median(microseconds):.1f} ({microseconds[0]:.1f} to {microseconds[-1]:.1f})"
        rows.append([words, spread, f"{statistics.median(ratios):.3g}"])
    return [
        "# What the ledger costs a step",
        "",
        f"Steps of {CLIPS} clips a rank; {ROUNDS} interleaved rounds. The copy is the least that a step takes: its "
        "latents are moved once, by one core, and nothing else is done. Median (lowest to highest), and median of the "
        "ratios.",
        "",
        *table(["what", "microseconds", "ledger / this"], rows),
        "",
        machine_line(setup),
    ]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        seconds = measure(Path(folder))
    setup = machine("numpy", "xxhash")
    write_results("ledger", {"setup": setup, "seconds": seconds}, page(seconds, setup))


if __name__ == "__main__":
    main()
