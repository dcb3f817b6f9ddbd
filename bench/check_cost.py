"""What the checks cost beside the rest of `wsm encode` with the built-in codec, trajectory by trajectory.

Trajectories of a generated home at the published size go through what encode does with each of them: read, laid on the
map, decoded, checked, viewed on the map, encoded, put together and written. The time of the checks is that of checked
videos less that of videos alone, measured one after the other in each round, in seconds of the processor. Run as
`python bench/check_cost.py`.
"""

import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
from reporting import machine, machine_line, table, write_results

from wsm_data.clips.build import Provenance, build_clip, read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.episode_gate import check_episode
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_view import view_scene
from wsm_data.codecs.clip_video import VideoMemory
from wsm_data.codecs.dct import DctCodec
from wsm_data.maps.scene_map import SceneMap, build_scene_map, floor_levels
from wsm_data.maps.voxels import voxels_from_cloud
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.shards.fragment import build_fragment, write_fragment
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

ROUNDS = 7
SYNTH = SynthConfig(
    seed=3, scenes=1, trajectories=4, cameras=("d435i",), min_frames=120, max_frames=200, layout="scene_folder"
)
DATASET = load_dataset("synthetic")
CLIP = ClipConfig()


@dataclass(frozen=True, kw_only=True)
class Home:
    """A generated scene: where it is, what a scan of it says, and its map."""

    source: Path
    container: Container
    records: Sequence[EpisodeRecord]
    scene_map: SceneMap


def main() -> None:
    cv2.setNumThreads(1)
    memory, codec = VideoMemory(), DctCodec()
    seconds: dict[str, list[dict[str, float]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        home = write_home(Path(folder) / "source")
        for number in range(ROUNDS + 1):
            for record in home.records:
                taken = one_trajectory(record, home, memory, codec, Path(folder) / "out")
                if number > 0:  # the first round compiles
                    seconds.setdefault(f"{record.id.text}, {record.frame_count} frames", []).append(taken)
    report(seconds)


def write_home(source: Path) -> Home:
    write_scene(source, 0, "d435i", SYNTH)
    reader = source_reader(DATASET)
    (container,) = reader.find_containers(source, DATASET)
    scan = reader.scan(source, container, DATASET, 10)
    floors = floor_levels([record.floor_z_m for record in scan.records])
    scene_map = build_scene_map(voxels_from_cloud(scan.cloud, DATASET.cloud), floors, DATASET.robot, 2.0)
    return Home(source=source, container=container, records=scan.records, scene_map=scene_map)


def one_trajectory(
    record: EpisodeRecord, home: Home, memory: VideoMemory, codec: DctCodec, out: Path
) -> dict[str, float]:
    """Seconds of the processor by part."""
    start = time.process_time()
    ((_, frames),) = source_reader(DATASET).iter_frames(home.source, home.container, DATASET, [record])
    laid = lay_path(record, home.scene_map, DATASET, CLIP)
    read = time.process_time()
    read_videos(record, frames, DATASET, CLIP, memory)
    decoded = time.process_time()
    verdicts, videos = check_episode(record, frames, home.scene_map, laid, DATASET, CLIP, memory)
    checked = time.process_time()
    if not all(verdict.keep for verdict in verdicts.values()):
        raise RuntimeError(f"the home must be sound, found {verdicts}")
    view = view_scene(record, laid, DATASET, CLIP)
    latents = codec.encode_many(videos.all)
    info = codec.describe()
    provenance = Provenance(dataset=DATASET, map_digest="", map_from="cloud", codec=info.name, codec_digest=info.digest)
    write_fragment(out, build_fragment(build_clip(record, view, videos, latents, provenance, CLIP)))
    built = time.process_time()
    decoding = decoded - read
    return {
        "decoding": decoding,
        "rest of encode": (decoded - start) + (built - checked),
        "checks": checked - decoded - decoding,
    }


def report(seconds: dict[str, list[dict[str, float]]]) -> None:
    setup = machine("numpy", "numba")
    rows, shares = [], []
    for name, rounds in seconds.items():
        medians = {part: statistics.median(one[part] for one in rounds) for part in rounds[0]}
        shares.append(medians["checks"] / medians["rest of encode"])
        rows.append([name, *(f"{value:.3f} s" for value in medians.values()), f"{shares[-1]:.0%}"])
    lines = [
        "# What checks cost beside encoding",
        "",
        f"Median over {len(shares)} trajectories: {statistics.median(shares):.0%} of what encode takes without them. "
        f"Medians of {ROUNDS} rounds each, seconds of the processor.",
        "",
        *table(["trajectory", "decoding", "encode without checks, decoding included", "checks", "share"], rows),
        "",
        machine_line(setup),
    ]
    write_results("check_cost", {"machine": setup, "seconds": seconds, "shares": shares}, lines)


if __name__ == "__main__":
    main()
