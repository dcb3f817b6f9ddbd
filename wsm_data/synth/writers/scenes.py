"""Synthetic scenes on disk, in the three layouts in which InternData-N1 exists.

The paths are those of the published archives, and of what the data set's public loader reads: archives of whole scenes,
the same unpacked, and one folder per trajectory.
"""

from collections.abc import Iterator
from pathlib import Path

from wsm_data.codecs.ply import ply_bytes
from wsm_data.files.atomic import write_bytes
from wsm_data.schema.source.layout import Layout
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.home import home_glb
from wsm_data.synth.writers.cloud import with_path
from wsm_data.synth.writers.containers import Member, write_archive, write_folder
from wsm_data.synth.writers.metadata import meta_files
from wsm_data.synth.writers.recording import SceneRecording, plan_recording, record_frames
from wsm_data.synth.writers.tables import episode_table

_DATA = "data/chunk-000"
_RGB = "videos/chunk-000/observation.images.rgb"
_DEPTH = "videos/chunk-000/observation.images.depth"


def write_scene(out: Path, scene_index: int, camera: str, config: SynthConfig) -> list[str]:
    """Build, record and write one scene as one camera sees it.

    The images, poses, intrinsics and mounts are the same bytes in every layout; what is at the path of the scene is
    replaced, and appears only when it is complete.

    Args:
        out: root of the source tree; the group's folder is made in it.
        scene_index: number of the physical scene, from 0.
        camera: name of the camera.
        config: everything else.

    Returns:
        Paths of the archive or folders written, relative to `out`, with `/`.
    """
    return write_recording(out, plan_recording(scene_index, camera, config), config)


def write_recording(out: Path, recording: SceneRecording, config: SynthConfig) -> list[str]:
    """What `write_scene` does, for a recording that is planned already."""
    group, scene = config.group(recording.camera), config.scene_name(recording.scene_index)
    if config.layout == Layout.SCENE_ARCHIVE:
        write_archive(out / group / f"{scene}.tar.gz", scene, _scene_members(recording, config), config.archive_level)
        return [f"{group}/{scene}.tar.gz"]
    if config.layout == Layout.SCENE_FOLDER:
        write_folder(out / group / scene, _scene_members(recording, config))
        return [f"{group}/{scene}"]
    names = [f"trajectory_{number:02d}" for number in range(len(recording.episodes))]
    write_folder(out / group / scene, _trajectory_members(recording, names, config))
    return [f"{group}/{scene}/{name}" for name in names]


def write_home(out: Path, recording: SceneRecording, config: SynthConfig) -> str:
    """Write the home of a recording as `<scene>.glb` in `out`, for viewers of 3D models; returns the file's name."""
    name = f"{config.scene_name(recording.scene_index)}.glb"
    write_bytes(out / name, home_glb(recording.home))
    return name


def _scene_members(recording: SceneRecording, config: SynthConfig) -> Iterator[Member]:
    """Layout 2: all episodes of a scene together. Depth comes before colour, as in a folder that is packed by name."""
    lengths = [len(episode.T_world_opengl) for episode in recording.episodes]
    for number, episode in enumerate(recording.episodes):
        table = episode_table(episode, recording.intrinsics, sum(lengths[:number]), config.matrices)
        yield f"{_DATA}/episode_{number:06d}.parquet", table
    yield from meta_files(lengths, recording.intrinsics).items()
    yield "meta/pointcloud.ply", ply_bytes(recording.cloud)
    pictures: list[Member] = []
    for number in range(len(lengths)):
        for frame, (jpeg, png) in enumerate(record_frames(recording, number, config)):
            name = f"episode_{number:06d}_{frame:03d}"
            pictures.append((f"{_RGB}/{name}.jpg", jpeg))
            yield f"{_DEPTH}/{name}.png", png
    yield from pictures


def _trajectory_members(recording: SceneRecording, names: list[str], config: SynthConfig) -> Iterator[Member]:
    """Layout 3: a folder per episode, with a cloud of its own that shows the path too."""
    for number, (name, episode) in enumerate(zip(names, recording.episodes, strict=True)):
        yield f"{name}/{_DATA}/episode_000000.parquet", episode_table(episode, recording.intrinsics, 0, config.matrices)
        cloud = with_path(recording.cloud, episode.T_world_camera[:, :3, 3])
        yield f"{name}/{_DATA}/path.ply", ply_bytes(cloud)
        for file, content in meta_files([len(episode.T_world_opengl)], recording.intrinsics).items():
            yield f"{name}/{file}", content
        for frame, (jpeg, png) in enumerate(record_frames(recording, number, config)):
            yield f"{name}/{_RGB}/{frame}.jpg", jpeg
            yield f"{name}/{_DEPTH}/{frame}.png", png
