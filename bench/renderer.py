"""Frames per second of the synthetic homes' renderer, against ray casting with trimesh and embree.

Ours draws colour and depth, textures and light included. The ray caster finds the first triangle each ray meets
(trimesh's `intersects_first`, which runs embree) and the depth on that triangle's plane in float64; no colour. Same
home, same poses along an expert's path, one thread each, interleaved. Run as `python bench/renderer.py`.
"""

import statistics
import time
from collections.abc import Callable

import numpy as np
from reporting import machine, machine_line, table, write_results

from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.camera import Intrinsics
from wsm_data.synth.config import CAMERAS, SynthConfig
from wsm_data.synth.drive.expert import plan_episode
from wsm_data.synth.drive.occupancy import scene_columns
from wsm_data.synth.home.home import Home, home_trimesh, make_home
from wsm_data.synth.render.render import make_buffers, render

ROUNDS = 7
FRAMES = 48
WANTED_TRIANGLES = 20_000
RAY_FRAMES = 6  # of them, for the ray caster, which is slow

Draw = Callable[[np.ndarray], np.ndarray]


def home_of_wanted_size() -> tuple[int, Home]:
    """Of the first scenes, the one whose number of triangles is nearest to what is wanted."""
    homes = {scene: make_home(0, scene) for scene in range(5)}
    scene = min(homes, key=lambda s: abs(len(homes[s].mesh.points_m) - WANTED_TRIANGLES))
    return scene, homes[scene]


def poses_in(home: Home) -> np.ndarray:
    """Camera poses spread over four episodes of an expert."""
    columns, config = scene_columns(home), SynthConfig()
    episodes = [plan_episode(home, columns, np.random.default_rng(seed), config) for seed in range(4)]
    every = [e.T_world_camera[np.linspace(0, len(e.T_world_camera) - 1, FRAMES // 4).astype(int)] for e in episodes]
    return np.concatenate(every)


def rasteriser(home: Home, camera: Intrinsics) -> Draw:
    buffers = make_buffers(home.mesh, camera)
    return lambda T: render(home.mesh, T, camera, buffers)[1]


def ray_caster(home: Home, camera: Intrinsics) -> Draw:
    mesh = home_trimesh(home)
    if "embree" not in type(mesh.ray).__module__:
        raise SystemExit(
            f"trimesh casts rays with {type(mesh.ray).__module__}; install the extra: pip install .[bench]"
        )
    rays_camera = pixel_rays(camera).reshape(-1, 3)
    a, b, c = (home.mesh.points_m[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    offsets = (normals * a).sum(axis=1)

    def cast(T: np.ndarray) -> np.ndarray:
        rays, origin = rays_camera @ T[:3, :3].T, T[:3, 3]
        hit = mesh.ray.intersects_first(np.broadcast_to(origin, rays.shape), rays)
        # rays have z = 1 in the camera, so the way along one is the depth
        depth = (offsets[hit] - normals[hit] @ origin) / np.einsum("ij,ij->i", normals[hit], rays)
        return np.where(hit >= 0, depth, 0.0).reshape(camera.height, camera.width)

    return cast


def frames_per_second(draw: Draw, poses: np.ndarray) -> float:
    start = time.perf_counter()
    for T in poses:
        draw(T)
    return len(poses) / (time.perf_counter() - start)


def agreement(ours: Draw, theirs: Draw, poses: np.ndarray) -> dict[str, float]:
    """Relative differences of depth over all pixels, and the share above 1e-6 (rays that graze an edge)."""
    pairs = [(ours(T).astype(np.float64), theirs(T)) for T in poses]
    found, true = (np.stack(depths) for depths in zip(*pairs, strict=True))
    error = np.abs(found - true) / np.maximum(true, 1e-9)
    return {
        "median": float(np.median(error)),
        "p99.9": float(np.quantile(error, 0.999)),
        "share_above_1e-6": float((error > 1e-6).mean()),
        "pixels": int(error.size),
    }


def measured(home: Home, camera: Intrinsics, poses: np.ndarray) -> dict[str, object]:
    """Rates of both contestants in interleaved rounds, and how far their depths are apart."""
    ours, theirs = rasteriser(home, camera), ray_caster(home, camera)
    few = poses[:: len(poses) // RAY_FRAMES]
    error = agreement(ours, theirs, few)  # compiles and warms up, too
    rates: dict[str, list[float]] = {"ours": [], "rays": []}
    for _ in range(ROUNDS):
        rates["ours"].append(frames_per_second(ours, poses))
        rates["rays"].append(frames_per_second(theirs, few))
    ratio = statistics.median(a / b for a, b in zip(rates["ours"], rates["rays"], strict=True))
    return {"frames_per_second": rates, "ratio": ratio, "depth_relative_error": error}


def row(name: str, camera: Intrinsics, result: dict) -> list[str]:
    rates, error = result["frames_per_second"], result["depth_relative_error"]
    ours = rates["ours"]
    return [
        f"{name}, {camera.width} x {camera.height}",
        f"{statistics.median(ours):.0f} ({min(ours):.0f} to {max(ours):.0f})",
        f"{statistics.median(rates['rays']):.1f}",
        f"{result['ratio']:.1f}",
        f"{error['median']:.0e}, {error['p99.9']:.0e}; {100 * error['share_above_1e-6']:.3f} %",
    ]


def main() -> None:
    scene, home = home_of_wanted_size()
    poses = poses_in(home)
    results = {name: measured(home, camera, poses) for name, camera in CAMERAS.items()}
    record, triangles = machine("numba", "numpy", "trimesh", "embreex"), len(home.mesh.points_m)
    header = ["camera", "ours, frames/s", "trimesh + embree", "ratio", "depth error: median, 99.9 %; grazing rays"]
    lines = [
        "# Renderer of the synthetic homes",
        "",
        *table(header, [row(name, camera, results[name]) for name, camera in CAMERAS.items()]),
        "",
        f"Home {scene} of seed 0, {triangles} triangles; frames/s, medians of {ROUNDS} interleaved rounds. Ours is",
        "colour, textures and light included; the rays give depth alone. Depth errors are relative; grazing rays are",
        "pixels above 1e-6, which meet an edge and are given to the other of two surfaces. The target is 200",
        "frames/s at 480 x 270.",
        "",
        machine_line(record),
    ]
    write_results("renderer", {"machine": record, "scene": scene, "triangles": triangles, **results}, lines)


if __name__ == "__main__":
    main()
