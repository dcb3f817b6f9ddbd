"""Speed of reading a scene archive from start to end, against tarfile and plain tar walks over fast decompressors.

Every contestant has the whole content of every member in memory once. Ours decompresses with zlib-ng and
checks header checksums, member kinds and paths as well; all of them check the gzip checksum at the end. Run as
`python bench/archives.py`.
"""

import gzip
import io
import statistics
import tarfile
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from generated_room import room_video, sensor
from isal import igzip
from reporting import machine, machine_line, table, write_results
from zlib_ng import gzip_ng

from wsm_data.readers.archive.tar_walk import walk_tar

FRAMES = 160
DISTINCT_FRAMES = 40
NOISE_LEVELS = 4.0
ROUNDS = 9
CASES = {"smooth depth": 0.0, "noisy depth": 0.0005}
"""Noise of depth as a share of depth. Exact depth of flat walls leaves a PNG that gzip can shrink; noise does not."""
OURS = "ours"


def write_archive(path: Path, depth_noise: float) -> int:
    """A scene archive of generated frames, compressed as `tar czf` does; returns the bytes of its members."""
    light, depth_m = room_video(seed=5, frames=DISTINCT_FRAMES)
    rgb = [cv2.imencode(".jpg", frame)[1].tobytes() for frame in sensor(light, NOISE_LEVELS)]
    depth_m = depth_m * (1 + depth_noise * np.random.default_rng(0).normal(size=depth_m.shape))
    depth = [cv2.imencode(".png", np.rint(frame * 10_000).astype(np.uint16))[1].tobytes() for frame in depth_m]
    total = 0
    with gzip.open(path, "wb", compresslevel=6) as file, tarfile.open(fileobj=file, mode="w|") as tar:
        for kind, images in (("depth", depth), ("rgb", rgb)):
            for t in range(FRAMES):
                data = images[t % DISTINCT_FRAMES]  # what repeats is megabytes apart: gzip looks back 32 kB
                info = tarfile.TarInfo(f"scene/videos/chunk-000/observation.images.{kind}/episode_000000_{t:03d}")
                info.size = len(data)
                tar.addfile(info, io.BytesIO(data))
                total += len(data)
    return total


def with_tarfile(opened: Callable[[Path], object]) -> Callable[[Path], int]:
    """Read with tarfile in stream mode, on top of a decompressing file."""

    def read(path: Path) -> int:
        with opened(path) as file, tarfile.open(fileobj=file, mode="r|") as tar:
            return sum(len(tar.extractfile(member).read()) for member in tar if member.isfile())

    return read


def with_plain_walk(opened: Callable[[Path], object]) -> Callable[[Path], int]:
    """Read with the simplest tar walk there is: plain ustar headers, nothing checked."""

    def read(path: Path) -> int:
        with opened(path) as file:
            return sum(plain_walk(file))

    return read


def plain_walk(file) -> Iterator[int]:
    while (header := file.read(512)) and header[0]:
        size = int(header[124:135], 8)
        yield len(file.read(size))
        file.read(-size % 512)
    while file.read(1 << 20):
        pass


def ours(path: Path) -> int:
    return sum(len(member.data) for member in walk_tar(path, "scene", lambda _name: True, 1 << 30))


CONTESTANTS: dict[str, Callable[[Path], int]] = {
    OURS: ours,
    "stdlib gzip + tarfile": with_tarfile(gzip.open),
    "zlib-ng + tarfile": with_tarfile(gzip_ng.open),
    "isal + tarfile": with_tarfile(igzip.open),
    "zlib-ng + plain walk": with_plain_walk(gzip_ng.open),
    "isal + plain walk": with_plain_walk(igzip.open),
}


def measure(path: Path, total: int) -> dict[str, list[float]]:
    """Seconds of every contestant, taking turns, each round started by another one."""
    seconds: dict[str, list[float]] = {name: [] for name in CONTESTANTS}
    names = list(CONTESTANTS)
    for turn in range(ROUNDS + 1):
        for name in names[turn % len(names) :] + names[: turn % len(names)]:
            start = time.perf_counter()
            found = CONTESTANTS[name](path)
            if turn > 0:  # the first round fills the page cache
                seconds[name].append(time.perf_counter() - start)
            if found != total:
                raise ValueError(f"{name} must read {total} bytes, found {found}")
    return seconds


def summarize(seconds: dict[str, list[float]], megabytes: float) -> dict[str, dict[str, object]]:
    results = {}
    for name, times in seconds.items():
        ratios = sorted(theirs / mine for theirs, mine in zip(times, seconds[OURS], strict=True))
        results[name] = {
            "megabytes_per_s": megabytes / statistics.median(times),
            "ours_is_faster_by": statistics.median(ratios),
            "spread": [ratios[0], ratios[-1]],
        }
    return results


def ratio(name: str, result: dict[str, object]) -> str:
    low, high = result["spread"]
    return "" if name == OURS else f"{result['ours_is_faster_by']:.2f} ({low:.2f} to {high:.2f})"


def compare(path: Path, depth_noise: float) -> dict[str, object]:
    total = write_archive(path, depth_noise)
    readers = summarize(measure(path, total), total / 1e6)
    return {"megabytes": total / 1e6, "compressed_share": path.stat().st_size / total, "readers": readers}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        results = {name: compare(Path(folder) / "scene.tar.gz", noise) for name, noise in CASES.items()}
    setup = machine("zlib-ng", "isal", "numpy", "opencv-python-headless")
    lines = [
        "# Reading a scene archive",
        "",
        f"{FRAMES} JPEG and {FRAMES} 16-bit PNG files of 480x270 in a gzip tar of level 6, page cache warm, one "
        f"thread, medians of {ROUNDS} alternating rounds; the ratio is taken within each round. MB are those "
        "of the content. Ours decompresses with zlib-ng.",
    ]
    for case, result in results.items():
        rows = [
            [name, f"{reader['megabytes_per_s']:.0f}", ratio(name, reader)]
            for name, reader in result["readers"].items()
        ]
        share = f"{result['megabytes']:.0f} MB, compressed to {result['compressed_share']:.0%}"
        header = [f"{case} ({share})", "MB/s", "ours is faster by (spread)"]
        lines += ["", *table(header, rows)]
    lines += ["", machine_line(setup)]
    write_results("archives", {"machine": setup, "cases": results}, lines)


if __name__ == "__main__":
    main()
