"""Faults planted in sound trajectories, and which checks find them; harmless oddities beside them, and sound homes.

Every kind is planted in three trajectories of generated homes, in what was read of them: poses, images, mount, camera
or cloud. A fault is found where any check refuses the trajectory. Generated trajectories in which nothing is planted
must all be kept. Run as `python bench/planted_faults.py`.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from planted_kinds import FAULTS, HARMLESS, Episode, Planter, cut
from reporting import machine, machine_line, table, write_results

from wsm_data.checks.record import check_record
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.soundness import SourceChecks, image_verdicts
from wsm_data.codecs.clip_video import VideoMemory
from wsm_data.codecs.images import depth_codes, rgb_pixels
from wsm_data.errors import DataError
from wsm_data.maps.scene_map import SceneMap, build_scene_map, floor_levels
from wsm_data.maps.voxels import voxels_from_cloud
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

TRIALS = 3
FRAMES = 60
DATASET = load_dataset("synthetic")
PLANTED_IN = SynthConfig(
    seed=7,
    scenes=3,
    trajectories=2,
    cameras=("d435i",),
    image_scale=0.5,
    min_frames=60,
    max_frames=120,
    layout="scene_folder",
)
SOUND = replace(PLANTED_IN, seed=11, trajectories=4, image_scale=0.25, min_frames=30, max_frames=60)


def load_episodes(source: Path) -> list[Episode]:
    reader = source_reader(DATASET)
    found = []
    for container in reader.find_containers(source, DATASET):
        scan = reader.scan(source, container, DATASET, 10)
        for record, frames in reader.iter_frames(source, container, DATASET, scan.records):
            n = min(FRAMES, record.frame_count)
            rgb = np.stack([rgb_pixels(one, "") for one in frames.rgb[:n]])
            raw = np.stack([depth_codes(one, "") for one in frames.depth[:n]])
            found.append(Episode(record=cut(record, slice(0, n)), rgb=rgb, raw=raw, cloud=scan.cloud))
    return found


def found_in(episode: Episode, dataset: DatasetManifest = DATASET) -> list[str]:
    """Reason codes of everything that is wrong with a trajectory."""
    record = episode.record
    verdicts = check_record(record, dataset)
    reasons = [str(one.reason) for one in verdicts.values() if one.reason]
    if reasons:
        return reasons
    checks = SourceChecks(source=Path(), dataset=dataset, clip=ClipConfig(), depth_sample_every=10)
    frames = EpisodeFrames(rgb=tuple(episode.rgb), depth=tuple(episode.raw))
    try:
        said = image_verdicts(record, frames, map_of(episode), checks, _MEMORY)
    except DataError as error:
        return [str(error.reason)]
    return [str(one.reason) for one in said.values() if one.reason]


_MEMORY = VideoMemory()


def map_of(episode: Episode) -> SceneMap:
    voxels = voxels_from_cloud(episode.cloud, DATASET.cloud)
    return build_scene_map(voxels, floor_levels([episode.record.floor_z_m]), DATASET.robot, 2.0)


def planted(kinds: dict[str, Planter], episodes: Sequence[Episode], only: str) -> dict[str, list[list[str]]]:
    found: dict[str, list[list[str]]] = {}
    for number, (kind, plant) in enumerate(kinds.items()):
        if only not in kind:
            continue
        found[kind] = []
        for trial in range(TRIALS):
            one, other = (
                episodes[(2 * trial + number) % len(episodes)],
                episodes[(2 * trial + number + 3) % len(episodes)],
            )
            found[kind].append(found_in(plant(one, other, np.random.default_rng([number, trial]))))
        print(f"{kind}: {found[kind]}", flush=True)
    return found


def write_sources(folder: Path, config: SynthConfig) -> Path:
    if not folder.exists():
        for scene in range(config.scenes):
            write_scene(folder, scene, "d435i", config)
    return folder


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--sound", type=int, default=200, help="sound trajectories to check beside those that faults are planted in"
    )
    parser.add_argument(
        "--source", type=Path, help="folder with planted/ and sound/, which are generated where missing"
    )
    parser.add_argument("--only", default="", help="only kinds with this word, and nothing is written")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.source or Path(temporary)
        episodes = load_episodes(write_sources(folder / "planted", PLANTED_IN))
        faults, harmless = (planted(kinds, episodes, args.only) for kinds in (FAULTS, HARMLESS))
        if args.only:
            return
        scenes = -(-args.sound // SOUND.trajectories)
        sound = episodes + load_episodes(write_sources(folder / "sound", replace(SOUND, scenes=scenes)))
        refused = [reasons for one in sound if (reasons := found_in(one))]
    report(faults, harmless, len(sound), refused)


def report(
    faults: dict[str, list[list[str]]], harmless: dict[str, list[list[str]]], sound: int, refused: list[list[str]]
) -> None:
    counts = Counter(verdict_of(trials) for trials in faults.values())
    false = sum(bool(reasons) for trials in harmless.values() for reasons in trials)
    setup = machine("numpy", "opencv-python-headless", "numba")
    rows = [[kind, verdict_of(trials), first_reasons(trials)] for kind, trials in faults.items()]
    oddities = [[kind, verdict_of(trials), first_reasons(trials)] for kind, trials in harmless.items()]
    lines = [
        "# Planted faults",
        "",
        f"{len(faults)} kinds of faults in {TRIALS} trajectories each: {counts['always']} always found, "
        f"{counts['in part']} in part, {counts['never']} never. {len(harmless)} harmless oddities in {TRIALS} each: "
        f"{false} refused. {sound} sound trajectories: {len(refused)} refused.",
        "",
        *table(["fault", "found", "reason (first of each trial)"], rows),
        "",
        *table(["harmless", "refused", "reason"], oddities),
        "",
        machine_line(setup),
    ]
    record = {"machine": setup, "faults": faults, "harmless": harmless, "sound": sound, "refused": refused}
    write_results("planted_faults", record, lines)


def verdict_of(trials: list[list[str]]) -> str:
    hits = sum(bool(reasons) for reasons in trials)
    return "always" if hits == len(trials) else "in part" if hits else "never"


def first_reasons(trials: list[list[str]]) -> str:
    return ", ".join(sorted({f"`{reasons[0]}`" for reasons in trials if reasons}))


if __name__ == "__main__":
    main()
