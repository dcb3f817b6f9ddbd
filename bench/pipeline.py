"""Frames per second of `wsm index` + `wsm encode` without the codec, against a bare loop of decode and resize.

Ours runs the two stages as they are, from a source tree to clips on disk: two passes over the files, digests, checks,
surfaces, strict decoding, depth and pose agreement, occupancy, geodesic field, fragments flushed to disk. Only the
latents are zeros. Bare: read each file once, imdecode, area resize, keep nothing; with two processes each has half of
the files, which shows what the machine gives. Same frames, one thread each, interleaved. Run as
`python bench/pipeline.py`.
"""

import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from reporting import machine, machine_line, table, write_results

from pipelines.recipe import Recipe, stage_config
from pipelines.running.engines.local import run_local
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage import Outcome, StageContext, Unit
from pipelines.stages import encode, index
from pipelines.stages import map as map_stage
from wsm_data.codecs.dct import DctCodec
from wsm_data.schema.codec import CodecInfo

ROUNDS = 5
SCENES = 2
TRAJECTORIES = 13  # as in the archive of InternData-N1 that was measured: 13 episodes, 1,811 frames
LAYOUTS = ("scene_folder", "scene_archive")
SYNTH = {"scenes": SCENES, "trajectories": TRAJECTORIES, "cameras": ("d435i",), "min_frames": 120, "max_frames": 200}


class NoCodec:
    """A codec that costs nothing: latents of zeros."""

    def encode_many(self, videos: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [np.zeros((1 + len(v) // 4, 48, v.shape[1] // 16, v.shape[2] // 16), np.float32) for v in videos]

    def describe(self) -> CodecInfo:
        return replace(DctCodec().describe(), name="none")


def encode_without_codec(
    batch: Sequence[Unit], config: encode.EncodeConfig, context: StageContext
) -> Iterator[Outcome]:
    encode.make_codec = lambda _config: NoCodec()
    yield from encode.STAGE.process(batch, config, context)


def make_sources(folder: Path) -> tuple[dict[str, Path], list[tuple[Path, Path]]]:
    """The same scenes in two layouts, and the pairs of colour and depth files."""
    from wsm_data.synth.config import SynthConfig  # here: every worker imports this file, and needs no renderer
    from wsm_data.synth.writers.scenes import write_scene

    sources = {}
    for layout in LAYOUTS:
        sources[layout] = folder / layout
        config = SynthConfig(layout=layout, **SYNTH)
        for scene in range(SCENES):
            write_scene(sources[layout], scene, "d435i", config)
    rgb = sorted(sources["scene_folder"].rglob("*.jpg"))
    depth = sorted(sources["scene_folder"].rglob("*.png"))
    return sources, list(zip(rgb, depth, strict=True))


def bare_loop(pairs: Sequence[tuple[Path, Path]]) -> Iterator[int]:
    """Decode and resize; as a task of the same engine that runs ours, which sets OpenCV to one thread."""
    for rgb, depth in pairs:
        for path, flag in ((rgb, cv2.IMREAD_COLOR), (depth, cv2.IMREAD_UNCHANGED)):
            image = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), flag)
            cv2.resize(image, (320, 192), interpolation=cv2.INTER_AREA)
    yield len(pairs)


def our_stages(source: Path, run: Path, workers: int) -> float:
    """Seconds of index and encode; the map between them is not counted, it touches no frame."""
    recipe = Recipe(
        stages=("index", "map", "encode"),
        settings={"index": {"dataset": "synthetic"}, "encode": {"quality_share": 0.0}},
        source=str(source),
    )
    options = RunOptions(workers=workers, quiet=True)
    bare_encode = replace(encode.STAGE, process=encode_without_codec)
    spent = {}
    for name, stage in (("index", index.STAGE), ("map", map_stage.STAGE), ("encode", bare_encode)):
        spent[name] = run_stage(stage, stage_config(recipe, name, run), run / name, options).seconds
    shutil.rmtree(run)
    return spent["index"] + spent["encode"]


def measure(folder: Path) -> dict[str, object]:
    sources, pairs = make_sources(folder)
    first_start = start_up_seconds(1)  # of the server too, from which workers are forked
    contestants = {(name, workers): [] for name in ("bare", *LAYOUTS) for workers in (1, 2)}
    our_stages(sources["scene_folder"], folder / "warm", 1)
    for turn in range(ROUNDS):
        order = list(contestants)
        for name, workers in order if turn % 2 else reversed(order):
            start = time.perf_counter()
            if name == "bare":
                list(run_local([pairs[part::workers] for part in range(workers)], bare_loop, workers))
                contestants[name, workers].append(time.perf_counter() - start)
            else:
                contestants[name, workers].append(our_stages(sources[name], folder / "run", workers))
    seconds = {f"{name} x{workers}": times for (name, workers), times in contestants.items()}
    start_up = {"start_up": start_up_seconds(3), "first_start_up": first_start}
    return {"frames": len(pairs), "seconds": seconds, **start_up}


def start_up_seconds(rounds: int) -> float:
    """What two workers cost before their first frame: starting and ending two, twice, with nothing to do in them."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        for stage in (index.STAGE, encode.STAGE):
            list(run_local([stage.name, stage.name], load_and_end, 2))
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def load_and_end(name: str) -> Iterator[str]:
    yield name


def speed_ups(found: dict[str, object]) -> dict[str, dict[str, float]]:
    """Two workers against one: as measured, and with the start of their server, which a run of all stages has once."""
    once = found["first_start_up"] - found["start_up"]
    ratios = {}
    for name in ("bare", *LAYOUTS):
        pairs = list(zip(found["seconds"][f"{name} x1"], found["seconds"][f"{name} x2"], strict=True))
        ratios[name] = {
            "measured": statistics.median(one / two for one, two in pairs),
            "with_first_start": statistics.median(one / (two + once) for one, two in pairs),
        }
    return ratios


def main() -> None:
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        found = measure(Path(folder))
    frames, seconds = found["frames"], found["seconds"]
    rows, ratios = [], {}
    for name, times in seconds.items():
        ratio = sorted(bare / ours for bare, ours in zip(seconds["bare x1"], times, strict=True))
        ratios[name] = statistics.median(ratio)
        spread = f"{ratios[name]:.2f} ({ratio[0]:.2f} to {ratio[-1]:.2f})"
        rows.append([name, f"{frames / statistics.median(times):.0f}", spread])
    speed_up = speed_ups(found)
    setup = machine("numpy", "opencv-python-headless", "simplejpeg", "zlib-ng", "numba")
    lines = [
        "# Index + encode without the codec, against a bare decode and resize loop",
        "",
        f"{frames} frames (JPEG + 16-bit PNG) of 480x270 to 320x192 in {SCENES} scenes of {TRAJECTORIES} "
        f"trajectories, medians of {ROUNDS} "
        "interleaved rounds. Ours makes two passes and writes clips to disk; the bare loop reads each file once and "
        "keeps nothing. Archives hold the same files; the bare loop reads them from folders.",
        "",
        *table(["contestant x workers", "frames/s", "ratio to the bare loop (spread)"], rows),
        "",
        "Two workers against one, the start of the workers included (median of the rounds):",
        "",
        *[f"- {name}: {one['measured']:.2f} x" for name, one in speed_up.items()],
        "",
        f"Two workers of both stages start and end in {found['start_up']:.2f} s. The server that they are forked from "
        f"starts once a run, in {found['first_start_up'] - found['start_up']:.1f} s; a run of these two stages and "
        "nothing else would have "
        + " and ".join(f"{speed_up[layout]['with_first_start']:.2f} x ({layout})" for layout in LAYOUTS)
        + ".",
        "",
        machine_line(setup),
    ]
    write_results("pipeline", {"machine": setup, **found, "ratio_to_bare": ratios, "speed_up": speed_up}, lines)


if __name__ == "__main__":
    main()
