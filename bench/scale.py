"""What the driver of a run costs a unit, from ten thousand to a million trajectories with hardly anything in them.

The catalogue is generated: scenes of ten trajectories, whose containers, maps and clips hold a few bytes. `index`,
`split`, `map` and `encode` list, plan, journal, resume and end as they do in a run, with one worker; only what reads
images, measures clouds and encodes is left out, and the clip of a trajectory is one file. `pack` is planned alone.
Every measurement is a process of its own. `encode` is asked for half of its units first, and then for the rest. Goals:
1 ms a unit, nothing to do found out in 10 s for a million, growth at most linear. Run as `python bench/scale.py`, or
with other sizes as its arguments.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from reporting import machine, machine_line, table, write_results

from pipelines.artifacts.episode_table import EpisodeRow, row_json
from pipelines.recipe import Recipe, stage_config
from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage import AnyStage, Outcome, StageContext, Unit
from wsm_data.files.digest import sha256_bytes
from wsm_data.schema.identity import EpisodeId

SIZES = (10_000, 100_000)
A_SCENE = 10
STAGES = ("index", "split", "map", "encode")
RECIPE = Recipe(stages=(*STAGES, "pack"), settings={"index": {"dataset": "synthetic"}}, source="generated")


def list_scenes(trajectories: int) -> list[Unit]:
    return [
        Unit(id=f"generated_d435i/home_{scene:07d}", inputs={"files": sha256_bytes(b"%d" % scene)})
        for scene in range(trajectories // A_SCENE)
    ]


def index_scene(batch: Sequence[Unit], _config: object, _context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        group, scene = unit.id.split("/")
        rows = [
            EpisodeRow(
                id=EpisodeId(group, scene, f"{number:06d}"),
                container=unit.id,
                digest=sha256_bytes(f"{unit.id}/{number}".encode()),
                record_digest=sha256_bytes(f"record {unit.id}/{number}".encode()),
                frames=150,
                floor_z_m=0.0,
            )
            for number in range(A_SCENE)
        ]
        facts = {
            "frames": 150 * A_SCENE,
            "trajectories": A_SCENE,
            "container": {"id": unit.id, "layout": "scene_archive", "signature": unit.inputs["files"]},
            "episodes": [row_json(row) for row in rows],
            "surface": unit.inputs["files"],
            "cloud_refusal": None,
            "bytes": 10,
        }
        yield Outcome(unit=unit.id, digest=unit.inputs["files"], facts=facts)


def map_scene(batch: Sequence[Unit], _config: object, _context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        facts = {"floors": 1, "map_from": "cloud", "levels": [[0.0, unit.inputs["surface"]]]}
        yield Outcome(unit=unit.id, digest=unit.inputs["surface"], facts=facts)


def encode_clip(batch: Sequence[Unit], _config: object, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        path = context.out / "clips" / f"{unit.id}.clip"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"clip")
        facts = {"frames": 150, "bytes": 2_000_000, "source_digest": unit.inputs["trajectory"], "quality": None}
        yield Outcome(
            unit=unit.id, digest=sha256_bytes(unit.id.encode()), outputs=(f"clips/{unit.id}.clip",), facts=facts
        )


def stage_of(name: str, trajectories: int) -> AnyStage:
    stage = load_stage(name)
    if name == "index":
        return replace(stage, list_units=lambda _config: list_scenes(trajectories), process=index_scene)
    return replace(stage, process={"map": map_scene, "encode": encode_clip}.get(name, stage.process))


def measure(run: Path, name: str, trajectories: int, half: bool) -> dict[str, float]:
    """One stage in this process; with `half` it is asked for half of its units."""
    config = stage_config(RECIPE, name, run)
    began, spent = time.perf_counter(), time.process_time()
    if name == "pack":
        load_stage("pack").list_units(config)
        units = trajectories
    else:
        limit = {"limit": trajectories // 2} if half else {}
        report = run_stage(stage_of(name, trajectories), config, run / name, RunOptions(quiet=True, **limit))
        units = len(report.ran)
    return {
        "seconds": time.perf_counter() - began,
        "processor_s": time.process_time() - spent,
        "units": units,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9,
    }


def in_a_process(run: Path, name: str, trajectories: int, half: bool = False) -> dict[str, float]:
    command = [sys.executable, __file__, str(trajectories), "--run", str(run), "--stage", name]
    said = subprocess.run([*command, *(["--half"] if half else [])], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(said.stdout)


def measure_size(folder: Path, trajectories: int) -> dict[str, dict[str, dict[str, float]]]:
    run = folder / str(trajectories)
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name in STAGES:
        found[name] = {"first": in_a_process(run, name, trajectories, half=name == "encode")}
        if name == "encode":
            found[name]["rest"] = in_a_process(run, name, trajectories)
        found[name]["nothing"] = in_a_process(run, name, trajectories)
        print(trajectories, name, found[name], file=sys.stderr)
    found["pack"] = {"planned": in_a_process(run, "pack", trajectories)}
    print(trajectories, "pack", found["pack"], file=sys.stderr)
    return found


def page(found: dict[int, dict], about: dict[str, object]) -> list[str]:
    sizes = list(found)
    rows = []
    for stage, kind in [(one, kind) for one, kinds in found[sizes[0]].items() for kind in kinds]:
        seconds = [found[size][stage][kind]["processor_s"] for size in sizes]
        cells = [
            f"{spent:.3g} s, {spent / size * 1000:.3g} ms, {found[size][stage][kind]['peak_gb']:.2g} GB"
            for size, spent in zip(sizes, seconds, strict=True)
        ]
        growth = f"{seconds[-1] / seconds[-2]:.1f} x" if len(seconds) > 1 else ""
        rows.append([f"{stage}, {KINDS[kind]}", *cells, growth])
    header = ["", *(f"{size:,}" for size in sizes), "last tenfold"]
    lines = ["# What a driver costs a unit", "", *__doc__.splitlines()[2:], ""]
    lines += [
        "Seconds of the processor, milliseconds a trajectory, and the driver's peak memory. Other programs shared the "
        "machine; seconds on the wall are in scale.json.",
        "",
        *table(header, rows),
        "",
    ]
    return [*lines, machine_line(about)]


KINDS = {
    "first": "first run (of encode: half)",
    "rest": "the other half",
    "nothing": "nothing to do",
    "planned": "planned",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes", type=int, nargs="*", default=SIZES)
    parser.add_argument("--run", type=Path, help="measure one stage in this folder, in this process")
    parser.add_argument("--stage")
    parser.add_argument("--half", action="store_true")
    parser.add_argument("--work", help="where the runs lie; a temporary folder otherwise")
    asked = parser.parse_args()
    if asked.run:
        print(json.dumps(measure(asked.run, asked.stage, asked.sizes[0], asked.half)))
        return
    with tempfile.TemporaryDirectory(dir=asked.work) as folder:
        found = {size: measure_size(Path(folder), size) for size in asked.sizes}
    about = machine("pyarrow", "xxhash")
    write_results(
        "scale", {"machine": about, "found": {str(size): one for size, one in found.items()}}, page(found, about)
    )


if __name__ == "__main__":
    main()
