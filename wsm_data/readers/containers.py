"""What stands in a source tree: scene archives, scene folders and trajectory folders, mixed as they come."""

import logging
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json
from wsm_data.schema.dataset import DatasetManifest

_log = logging.getLogger(__name__)

CONTENT_FOLDERS = ("data", "meta", "videos")
"""The folders that hold a scene or a trajectory, in the order they are read."""

_ARCHIVE = re.compile(r"(?P<scene>.+?)\.(tar\.gz|tgz|tar|tar\.[a-z0-9]+|zip|gz)")


class Layout(StrEnum):
    """The three forms in which trajectories are published."""

    SCENE_ARCHIVE = "scene_archive"
    SCENE_FOLDER = "scene_folder"
    TRAJECTORY_FOLDER = "trajectory_folder"


@dataclass(frozen=True, kw_only=True)
class Container:
    """One archive or folder: the unit that is scanned as a whole.

    Attributes:
        id: path relative to the source root, with `/`.
        layout: how it is read.
        path: the same as `id`, relative to the source root; kept apart so that an id is never taken for a path.
        group: dataset group, the first folder of the path.
        scene: name of the scene, without the endings of an archive.
        episode: name of the trajectory folder; None for scenes.
        signature: digest of (relative name, size, mtime in ns) of all its files: the cheap test for "was anything
            touched"; it says nothing about content.
    """

    id: str
    layout: Layout
    path: str
    group: str
    scene: str
    episode: str | None
    signature: str


def find_containers(source: Path, dataset: DatasetManifest) -> list[Container]:
    """List everything below `source` that is or should be a scene or a trajectory, sorted by id.

    `<group>/<scene>.tar.gz` is an archive, `<group>/<scene>/` a scene, and every further folder in it a trajectory.
    A folder that turns out to hold nothing is listed as well, so that it is refused by name and not passed over; so is
    an archive of another kind. Hidden names are not looked at. The same scene may stand there in several forms:
    each is a container.

    Raises:
        ConfigError: the source is absent, is no folder, or holds no container.
    """
    if not source.is_dir():
        raise ConfigError(
            f"the source of data set {dataset.name!r} must be a folder of <group>/<scene> folders or archives, "
            f"but {source} {'is a file' if source.exists() else 'does not exist'}"
        )
    containers = [found for group in _entries(source) if group.is_dir() for found in _in_group(source, group)]
    if not containers:
        raise ConfigError(
            f"the source of data set {dataset.name!r} is empty: no <group>/<scene> folder and no "
            f"<group>/<scene>.tar.gz below {source}"
        )
    return sorted(containers, key=lambda container: container.id)


def _entries(folder: Path | os.DirEntry[str]) -> list[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        return sorted((entry for entry in entries if not entry.name.startswith(".")), key=lambda entry: entry.name)


def _in_group(source: Path, group: os.DirEntry[str]) -> Iterator[Container]:
    for entry in _entries(group):
        match = _ARCHIVE.fullmatch(entry.name)
        if entry.is_dir():
            yield from _in_scene(source, group.name, entry)
        elif match:
            signature = digest_json([_file_line("", entry)])
            yield _container(source, entry.path, Layout.SCENE_ARCHIVE, group.name, match["scene"], None, signature)
        else:
            _log.warning("%s is neither a scene folder nor an archive; it is not read", entry.path)


def _in_scene(source: Path, group: str, scene: os.DirEntry[str]) -> Iterator[Container]:
    folders = [entry for entry in _entries(scene) if entry.is_dir()]
    trajectories = [entry for entry in folders if entry.name not in CONTENT_FOLDERS]
    if not trajectories or any(entry.name in ("data", "videos") for entry in folders):
        yield _container(source, scene.path, Layout.SCENE_FOLDER, group, scene.name, None, _folder_signature(scene))
    for entry in trajectories:
        signature = _folder_signature(entry)
        yield _container(source, entry.path, Layout.TRAJECTORY_FOLDER, group, scene.name, entry.name, signature)


def _container(
    source: Path, path: str, layout: Layout, group: str, scene: str, episode: str | None, signature: str
) -> Container:
    name = Path(path).relative_to(source).as_posix()
    return Container(id=name, layout=layout, path=name, group=group, scene=scene, episode=episode, signature=signature)


def _folder_signature(folder: os.DirEntry[str]) -> str:
    contents = [entry for entry in _entries(folder) if entry.name in CONTENT_FOLDERS and entry.is_dir()]
    return digest_json([line for entry in contents for line in _file_lines(f"{entry.name}/", entry)])


def _file_lines(prefix: str, folder: os.DirEntry[str]) -> Iterator[list[object]]:
    for entry in _entries(folder):
        if entry.is_dir():
            yield from _file_lines(f"{prefix}{entry.name}/", entry)
        else:
            yield _file_line(prefix, entry)


def _file_line(prefix: str, entry: os.DirEntry[str]) -> list[object]:
    status = entry.stat()
    return [f"{prefix}{entry.name}", status.st_size, status.st_mtime_ns]
