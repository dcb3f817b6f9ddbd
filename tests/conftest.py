"""For all tests: the same property-test examples everywhere; a small synthetic source, and the pipeline over it."""

import fcntl
import hashlib
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from pipelines.recipe import Recipe, stage_config
from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage_report import StageReport
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

settings.register_profile("wsm", deadline=None, derandomize=True)  # a busy machine breaks no time limit
settings.load_profile("wsm")

SMALL_CLIP = {"width": 96, "height": 64}
STAGES = ("index", "split", "map", "encode", "pack")

RunPipeline = Callable[..., dict[str, StageReport]]


def small_synth(**changes: object) -> SynthConfig:
    """Settings of a source that is generated in a few seconds: small images, short trajectories, wide steps."""
    small: dict[str, object] = {
        "scenes": 1,
        "trajectories": 2,
        "image_scale": 0.25,
        "min_frames": 10,
        "max_frames": 40,
        "min_step_m": 0.1,
        "max_step_m": 0.3,
    }
    return SynthConfig(**{**small, **changes})  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def make_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], object]], Path]:
    """Fills a folder of a name once for all processes of the tests; nobody may change what is in it."""
    base = tmp_path_factory.getbasetemp()
    common = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def make(name: str, fill: Callable[[Path], object]) -> Path:
        folder, done = common / name, common / f"{name}.done"
        with (common / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                shutil.rmtree(folder, ignore_errors=True)
                fill(folder)
                done.touch()
        return folder

    return make


@pytest.fixture(scope="session")
def make_source(make_once: Callable[[str, Callable[[Path], object]], Path]) -> Callable[..., Path]:
    """Generates a source tree once per set of settings."""

    def make(**changes: object) -> Path:
        config = small_synth(**changes)

        def write(out: Path) -> None:
            for scene in range(config.scenes):
                for camera in config.cameras:
                    write_scene(out, scene, camera, config)

        return make_once(f"source-{hashlib.sha256(repr(config).encode()).hexdigest()[:16]}", write)

    return make


@pytest.fixture(scope="session")
def run_pipeline() -> RunPipeline:
    """Runs the stages up to the release; returns their reports by name."""

    def run(
        source: Path,
        out: Path,
        *,
        settings: Mapping[str, Mapping[str, object]] | None = None,
        workers: int = 1,
        stages: tuple[str, ...] = STAGES,
        max_refused: float = 0.9,
    ) -> dict[str, StageReport]:
        base: dict[str, dict[str, object]] = {
            "index": {"dataset": "synthetic", "depth_sample_every": 2},
            "split": {"test_fraction": 0.3},
            "encode": {"clip": dict(SMALL_CLIP), "quality_share": 0.5},
            "pack": {"shard_mib": 1},
        }
        for name, changes in (settings or {}).items():
            base[name] = {**base.get(name, {}), **changes}
        recipe = Recipe(stages=stages, settings=base, source=str(source))
        options = RunOptions(workers=workers, max_refused=max_refused, quiet=True)
        return {
            name: run_stage(load_stage(name), stage_config(recipe, name, out), out / name, options) for name in stages
        }

    return run


@pytest.fixture(scope="session")
def homes_release(make_source: Callable[..., Path], run_pipeline: RunPipeline, make_once: Callable[..., Path]) -> Path:
    """A release of two homes, three drives of either camera in each."""
    run = make_once("homes", lambda out: run_pipeline(make_source(scenes=2, trajectories=3), out))
    return run / "pack" / "release"


@pytest.fixture(scope="session")
def file_digests() -> Callable[[Path], dict[str, str]]:
    """sha256 of every file below a folder, by relative name."""

    def digests(folder: Path) -> dict[str, str]:
        return {
            str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*"))
            if path.is_file()
        }

    return digests


@pytest.fixture(scope="session")
def distance_to_mesh_m() -> Callable[..., np.ndarray]:
    """The distance of points to triangles as formulas say it, without an index: the judge of what lies on a surface."""
    return _distance_to_mesh_m


def _distance_to_mesh_m(points: np.ndarray, triangles: np.ndarray, reach_m: float = 0.5) -> np.ndarray:
    """Distance of points [N, 3] to the nearest of triangles [F, 3, 3], at most `reach_m`; slow and obvious."""
    low, high = triangles.min(axis=1) - reach_m, triangles.max(axis=1) + reach_m
    distances = np.full(len(points), reach_m)
    for number, point in enumerate(points):
        near = triangles[((point >= low) & (point <= high)).all(axis=1)]
        if len(near):
            distances[number] = min(reach_m, _point_to_triangles_m(point, near).min())
    return distances


def _point_to_triangles_m(point: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The foot of the perpendicular where it falls into the triangle, else the nearest point of an edge."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    doubled = np.linalg.norm(normal, axis=1)
    sound = doubled > 1e-12
    unit = normal / np.where(sound, doubled, 1.0)[:, None]
    height = ((point - a) * unit).sum(axis=1)
    foot = point - height[:, None] * unit
    inside = sound.copy()
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, foot - start) * unit).sum(axis=1) >= 0
    edges = [_point_to_segments_m(point, start, end) for start, end in ((a, b), (b, c), (c, a))]
    return np.where(inside, np.abs(height), np.min(edges, axis=0))


def _point_to_segments_m(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    share = ((point - start) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18)
    return np.linalg.norm(start + np.clip(share, 0, 1)[:, None] * along - point, axis=1)
