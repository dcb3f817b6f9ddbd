"""What stands in a source tree: scene archives, scene folders and trajectory folders, mixed as they come."""

import logging
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json
from wsm_data.readers.source import Container
from wsm_data.readers.unreadable import error_name
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.source.layout import Layout

_log = logging.getLogger(__name__)

CONTENT_FOLDERS = ("data", "meta", "videos")
"""The folders that hold a scene or a trajectory, in the order they are read."""

SCENE_CLOUD = "meta/pointcloud.ply"
"""Where a scene keeps its cloud; trajectory folders without one of their own share it."""

_DEEPEST_LEVEL = 8
"""Nothing is read of a scene that lies in more folders than four."""

EXPECTS = "<group>/<scene>.tar.gz, <group>/<scene>/data or <group>/<scene>/<trajectory>/data"
"""The three layouts as a person would look for them."""

_ENDING = r"tar\.(?:gz|zst|bz2|xz|lz4|lzma|lz|z|br)|tar|tgz|tzst|tbz2?|txz|tlz|zip|7z|rar|gz"
_ARCHIVE = re.compile(rf"(?P<scene>.+?)\.(?:{_ENDING})", re.I)
_PART = re.compile(
    rf"(?P<scene>.+?)\.(?:(?:{_ENDING})[._-](?:[a-z]{{2}}|a(?!sc)[a-z]{{2}}|part[._-]?[a-z0-9]+|[0-9]{{1,4}})"
    r"|[rz][0-9]{2})",
    re.I,
)
"""What `split`, 7-Zip and others call the pieces of an archive: `.tar.gz.aa`, `.7z.001`, `.z01`."""

_UNFINISHED = re.compile(
    r"(?P<whole>.+)\.(part|partial|incomplete|crdownload|download|opdownload|aria2|filepart)", re.I
)


def find_containers(source: Path, dataset: DatasetManifest) -> list[Container]:
    """List everything below `source` that is or should be a scene or a trajectory, sorted by id.

    `<group>/<scene>.tar.gz` is an archive, `<group>/<scene>/` a scene, and every further folder in it a trajectory.
    A folder that turns out to hold nothing is listed as well, so that it is refused by name and not passed over; so are
    an archive of another kind, a piece of one, one at another depth, an unfinished download, and a link that leads
    nowhere. Hidden names are not looked at.
    The same scene may stand there in several forms: each is a container.

    Raises:
        ConfigError: the source is absent, is no folder, holds no container, or it or a group cannot be listed.
    """
    if not source.is_dir():
        raise ConfigError(
            f"the source of data set {dataset.name!r} must be a folder of <group>/<scene> folders or archives, "
            f"but {source} {'is a file' if source.exists() else 'does not exist'}"
        )
    try:
        top = _entries(source)
        groups = [_entries(group) for group in top if _is_folder(group)]
    except OSError as error:
        message = f"the source of data set {dataset.name!r} and its groups must be folders that can be listed"
        raise ConfigError(f"{message}, but {error.filename}: {error.strerror}") from error
    containers = [found for entries in groups for found in _in_group(source, entries)]
    if not containers:
        raise ConfigError(
            f"the source of data set {dataset.name!r} is empty: no <group>/<scene> folder and no "
            f"<group>/<scene>.tar.gz below {source}; the source is the folder that holds the groups"
        )
    containers += [_archive(source, entry) for entry in top if _is_archive(entry)]
    return sorted(containers, key=lambda container: container.id)


@dataclass(frozen=True, slots=True)
class Place:
    """Where in a source a container stands.

    Attributes:
        group: dataset group, the first folder of the path.
        scene: name of the scene, without the endings of an archive.
        episode: name of the trajectory folder; None for scenes.
    """

    group: str
    scene: str
    episode: str | None


def place_of(container: Container) -> Place:
    """Group, scene and trajectory of a container, as its path says."""
    group, scene, *episode = container.id.split("/")  # archives at another depth are refused before
    if container.layout == Layout.SCENE_ARCHIVE:
        unfinished = _UNFINISHED.fullmatch(scene)
        whole = unfinished["whole"] if unfinished else scene
        archive = _ARCHIVE.fullmatch(whole) or _PART.fullmatch(whole)
        scene = archive["scene"] if archive else whole
    return Place(group, scene, episode[0] if episode else None)


def is_unfinished(name: str) -> bool:
    """Whether a file's name is one that programs give to downloads that are not complete."""
    return _UNFINISHED.fullmatch(name) is not None


def is_part(name: str) -> bool:
    """Whether a file's name is that of a piece of an archive that was split."""
    return _ARCHIVE.fullmatch(name) is None and _PART.fullmatch(name) is not None


def _entries(folder: Path | os.DirEntry[str]) -> list[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        return sorted((entry for entry in entries if not entry.name.startswith(".")), key=lambda entry: entry.name)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # links in a circle, for one
        return False


def _leads_nowhere(entry: os.DirEntry[str]) -> bool:
    """Whether it is a link whose target is not there, or cannot be looked at at all."""
    try:
        entry.stat()
    except OSError:
        return True
    return False


def _in_group(source: Path, entries: list[os.DirEntry[str]]) -> Iterator[Container]:
    for entry in entries:
        if _is_folder(entry):
            yield from _in_scene(source, entry)
        elif _is_archive(entry):
            yield _archive(source, entry)
        elif _leads_nowhere(entry):
            yield _container(source, entry, Layout.SCENE_FOLDER, [_file_line("", entry)])
        else:
            _log.warning("%s is neither a scene folder nor an archive; it is not read", entry.path)


def _is_archive(entry: os.DirEntry[str]) -> bool:
    name = entry.name
    is_named = bool(_ARCHIVE.fullmatch(name) or _PART.fullmatch(name) or is_unfinished(name))
    return is_named and not _is_folder(entry)


def _archive(source: Path, entry: os.DirEntry[str]) -> Container:
    return _container(source, entry, Layout.SCENE_ARCHIVE, [_file_line("", entry)])


def _in_scene(source: Path, scene: os.DirEntry[str]) -> Iterator[Container]:
    try:
        entries = _entries(scene)
    except OSError as error:  # listed all the same: reading it says why not
        yield _container(source, scene, Layout.SCENE_FOLDER, [error_name(error)])
        return
    archives = [entry for entry in entries if _is_archive(entry)]
    yield from (_archive(source, entry) for entry in archives)
    folders = [entry for entry in entries if entry not in archives and (_is_folder(entry) or _leads_nowhere(entry))]
    trajectories = [entry for entry in folders if entry.name not in CONTENT_FOLDERS]
    if not (trajectories or archives) or any(entry.name in ("data", "videos") for entry in folders):
        yield _container(source, scene, Layout.SCENE_FOLDER, _content_lines(scene))
    cloud = _scene_cloud_line(scene)
    for entry in trajectories:
        yield _container(source, entry, Layout.TRAJECTORY_FOLDER, [*_content_lines(entry), *cloud])


def _container(source: Path, entry: os.DirEntry[str], layout: Layout, lines: Sequence[object]) -> Container:
    """The container at `entry`; the cloud of its scene is among the lines of a trajectory folder."""
    id_ = Path(entry.path).relative_to(source).as_posix()
    return Container(id=id_, layout=layout, signature=digest_json(list(lines)))


def _content_lines(folder: os.DirEntry[str]) -> list[list[object]]:
    """A line for each file of a scene or trajectory, and one for each file or folder that cannot be looked at."""
    try:
        contents = [entry for entry in _entries(folder) if entry.name in CONTENT_FOLDERS]
    except OSError as error:
        return [[folder.name, error_name(error)]]
    return [line for entry in contents for line in _lines("", entry, ())]


def _lines(prefix: str, entry: os.DirEntry[str], above: tuple[int, ...]) -> Iterator[list[object]]:
    """Lines of a file, or of all files below a folder; not of those in a folder that lies in itself, or deep down."""
    if not _is_folder(entry):
        yield _file_line(prefix, entry)
        return
    try:
        identity = entry.stat().st_ino
        entries = [] if identity in above or len(above) > _DEEPEST_LEVEL else _entries(entry)
    except OSError as error:
        yield [f"{prefix}{entry.name}/", error_name(error)]
        return
    for inner in entries:
        yield from _lines(f"{prefix}{entry.name}/", inner, (*above, identity))


def _file_line(prefix: str, entry: os.DirEntry[str]) -> list[object]:
    try:
        status = entry.stat()
    except OSError as error:
        return [f"{prefix}{entry.name}", error_name(error)]
    return [f"{prefix}{entry.name}", status.st_size, status.st_mtime_ns]


def _scene_cloud_line(scene: os.DirEntry[str]) -> list[list[object]]:
    try:
        status = Path(scene.path, SCENE_CLOUD).stat()
    except FileNotFoundError:
        return []
    except OSError as error:
        return [[f"../{SCENE_CLOUD}", error_name(error)]]
    return [[f"../{SCENE_CLOUD}", status.st_size, status.st_mtime_ns]]
