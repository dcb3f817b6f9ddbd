"""Time to have a coloured point cloud of 10^6 points, against a memory map, plyfile and trimesh.

`open` ends when positions and colours are arrays; `use` when they are contiguous float32 and uint8, so that no reader
wins by putting the work off. Run as `python bench/point_clouds.py`.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import plyfile
import trimesh
from reporting import machine, machine_line, table, write_results

from wsm_data.readers.ply import read_point_cloud

POINTS = 1_000_000
ROUNDS = 15
OURS = "ours, from a path"
VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
HEADER = (
    f"ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
).encode()

Arrays = tuple[np.ndarray, np.ndarray]


def write_cloud(path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = np.zeros(POINTS, VERTEX)
    for axis in "xyz":
        rows[axis] = rng.uniform(-5, 5, POINTS)
    for channel in ("red", "green", "blue"):
        rows[channel] = rng.integers(0, 256, POINTS)
    path.write_bytes(HEADER + rows.tobytes())


def ours(path: Path) -> Arrays:
    cloud = read_point_cloud(path)
    return cloud.xyz_m, cloud.rgb_u8


def ours_from_bytes(path: Path) -> Arrays:
    cloud = read_point_cloud(path.read_bytes())
    return cloud.xyz_m, cloud.rgb_u8


def memory_map(path: Path) -> Arrays:
    packed = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    rows = np.memmap(path, packed, "r", len(HEADER), POINTS)
    return rows["xyz"], rows["rgb"]


def with_plyfile(path: Path) -> Arrays:
    vertex = plyfile.PlyData.read(path)["vertex"]
    xyz = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    return xyz, np.stack([vertex[channel] for channel in ("red", "green", "blue")], axis=1)


def with_trimesh(path: Path) -> Arrays:
    cloud = trimesh.load(path)
    return np.asarray(cloud.vertices), np.asarray(cloud.colors)[:, :3]


CONTESTANTS: dict[str, Callable[[Path], Arrays]] = {
    OURS: ours,
    "ours, from bytes": ours_from_bytes,
    "numpy memory map": memory_map,
    "plyfile": with_plyfile,
    "trimesh.load": with_trimesh,
}


def measure(path: Path) -> dict[str, dict[str, list[float]]]:
    """Seconds of every contestant, taking turns, each round started by another one; all must find the same."""
    seconds = {name: {"open": [], "use": []} for name in CONTESTANTS}
    names, expected = list(CONTESTANTS), None
    for turn in range(ROUNDS + 1):
        for name in names[turn % len(names) :] + names[: turn % len(names)]:
            start = time.perf_counter()
            xyz, rgb = CONTESTANTS[name](path)
            opened = time.perf_counter() - start
            found = np.ascontiguousarray(xyz, np.float32), np.ascontiguousarray(rgb, np.uint8)
            used = time.perf_counter() - start
            expected = expected or found
            if not all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True)):
                raise ValueError(f"{name} must find the same points as the others")
            if turn > 0:  # the first round fills the page cache
                seconds[name]["open"].append(opened)
                seconds[name]["use"].append(used)
    return seconds


def summarize(seconds: dict[str, dict[str, list[float]]]) -> dict[str, dict[str, object]]:
    results = {}
    for name, times in seconds.items():
        results[name] = {}
        for what, values in times.items():
            ratios = sorted(theirs / mine for theirs, mine in zip(values, seconds[OURS][what], strict=True))
            results[name][f"{what}_ms"] = 1e3 * statistics.median(values)
            results[name][f"{what}_ratio"] = statistics.median(ratios)
            results[name][f"{what}_spread"] = [ratios[0], ratios[-1]]
    return results


def ratio(result: dict[str, object], what: str) -> str:
    low, high = result[f"{what}_spread"]
    return f"{result[f'{what}_ratio']:.2f} ({low:.2f} to {high:.2f})"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.ply"
        write_cloud(path)
        results = summarize(measure(path))
    setup = machine("numpy", "plyfile", "trimesh")
    rows = [
        [name, f"{r['open_ms']:.2f}", f"{r['use_ms']:.1f}", ratio(r, "open"), ratio(r, "use")]
        for name, r in results.items()
    ]
    lines = [
        "# Reading a point cloud",
        "",
        f"{POINTS:,} coloured points, binary little endian, page cache warm, one thread, medians of {ROUNDS} "
        "alternating rounds. Open: until positions and colours are arrays. Use: until they are contiguous float32 and "
        f"uint8. The ratio is time over the time of `{OURS}` within each round.",
        "",
        *table(["reader", "open, ms", "use, ms", "open, ratio (spread)", "use, ratio (spread)"], rows),
        "",
        machine_line(setup),
    ]
    write_results("point_clouds", {"machine": setup, "points": POINTS, "readers": results}, lines)


if __name__ == "__main__":
    main()
