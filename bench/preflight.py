"""Speed of `wsm preflight` over a scene archive, against decompression alone by the gzip program and by Python's gzip.

A generated home in one archive, compressed as `tar czf` does. Preflight decompresses it, walks the tar, checks every
image from its first byte to its last and holds counts against the meta files; the others only decompress, and throw
away what comes. One process each, interleaved, the file in the page cache. Run as `python bench/preflight.py`.
"""

import gzip
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
from reporting import machine, machine_line, table, write_results

from wsm_data.readers.interndata.preflight import preflight_container
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

ROUNDS = 9
PIECE_BYTES = 1 << 20
OURS = "wsm preflight"
SYNTH = SynthConfig(
    seed=13,
    scenes=1,
    trajectories=3,
    cameras=("d435i",),
    image_scale=1.0,
    min_frames=60,
    max_frames=120,
    layout="scene_archive",
)
DATASET = load_dataset("synthetic")


def with_preflight(source: Path) -> Callable[[Path], None]:
    (container,) = source_reader(DATASET).find_containers(source, DATASET)

    def read(_archive: Path) -> None:
        found = preflight_container(source, container, DATASET, walk=True)
        if found.refusals or not found.walked:
            raise RuntimeError(f"the archive must be sound, found {found}")

    return read


def with_program(archive: Path) -> None:
    subprocess.run(["gzip", "-dc", str(archive)], check=True, stdout=subprocess.DEVNULL)


def with_python(archive: Path) -> None:
    with gzip.open(archive) as file:
        while file.read(PIECE_BYTES):
            pass


def main() -> None:
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder)
        write_scene(source, 0, "d435i", SYNTH)
        (archive,) = source.rglob("*.tar.gz")
        with gzip.open(archive) as file:
            content_bytes = sum(len(piece) for piece in iter(lambda: file.read(PIECE_BYTES), b""))
        contestants = {OURS: with_preflight(source), "gzip -dc": with_program, "Python's gzip": with_python}
        seconds: dict[str, list[float]] = {name: [] for name in contestants}
        for _ in range(ROUNDS):
            for name, read in contestants.items():
                start = time.perf_counter()
                read(archive)
                seconds[name].append(time.perf_counter() - start)
        sizes = {"archive": archive.stat().st_size, "content": content_bytes}
    report(seconds, sizes)


def report(seconds: dict[str, list[float]], sizes: dict[str, int]) -> None:
    setup = machine("zlib-ng")
    rows = []
    for name, taken in seconds.items():
        ratio = statistics.median(other / ours for other, ours in zip(taken, seconds[OURS], strict=True))
        speed = sizes["content"] / statistics.median(taken) / 1e6
        rows.append([name, f"{speed:.0f} MB/s", f"{min(taken):.3f} to {max(taken):.3f} s", f"{ratio:.2f}"])
    lines = [
        "# Preflight",
        "",
        f"An archive of {sizes['archive'] / 1e6:.1f} MB with {sizes['content'] / 1e6:.1f} MB in it; medians of "
        f"{ROUNDS} interleaved rounds.",
        "",
        *table(["reader", "content", "time", "preflight is so many times as fast"], rows),
        "",
        machine_line(setup),
    ]
    write_results("preflight", {"machine": setup, "bytes": sizes, "seconds": seconds}, lines)


if __name__ == "__main__":
    main()
