"""The files of a container under names that do not say how it is stored: `data/...`, `meta/...`, `videos/...`."""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.tar_walk import Member, walk_tar
from wsm_data.readers.interndata.containers import CONTENT_FOLDERS, SCENE_CLOUD, is_unfinished
from wsm_data.readers.source import Container
from wsm_data.readers.unreadable import read_file, refusing_unreadable
from wsm_data.schema.layout import Layout

_READ_FOLDER = re.compile(r"data|meta|videos|(data|videos)/[^/]+|videos/[^/]+/observation\.images\.(rgb|depth)")


def iter_members(source: Path, container: Container, wanted: Callable[[str], bool]) -> Iterator[Member]:
    """Yield the wanted files of a container, named relative to the root of its scene or trajectory.

    Archives come in stored order, folders in sorted order; nothing may depend on either. An archive of trajectory
    folders gives `<trajectory>/data/...` and so on. A member's data is valid until the next member is asked for. A file
    of a folder that cannot be read is a member with a refusal: its frame is lost, others are not.

    Raises:
        DataError: an `archive.*` reason, `container.several_scenes`, or `file.unreadable`.
    """
    if container.layout == Layout.SCENE_ARCHIVE:
        yield from _from_archive(source, container, wanted)
    else:
        yield from _from_folder(source / container.id, container.id, wanted)


def scene_cloud(source: Path, container: Container) -> Member | None:
    """The cloud of the scene that a trajectory folder lies in; None where the scene has none."""
    path = (source / container.id).parent / SCENE_CLOUD
    if not os.path.lexists(path):
        return None
    return _member(str(path), f"../{SCENE_CLOUD}", f"{container.id}:../{SCENE_CLOUD}")


def _from_folder(root: Path, where: str, wanted: Callable[[str], bool]) -> Iterator[Member]:
    with refusing_unreadable(where):
        present = {path.name for path in root.iterdir()}
    for content in (name for name in CONTENT_FOLDERS if name in present):
        for name in _walk(root, content, where):
            if wanted(name):
                yield _member(f"{root}/{name}", name, f"{where}:{name}")
            elif _READ_FOLDER.fullmatch(name):
                with refusing_unreadable(f"{where}:{name}"):
                    (root / name).stat()


def _walk(root: Path, content: str, where: str) -> Iterator[str]:
    """Names of all files, in sorted order; a folder that cannot be reached looks like a file."""

    def refuse(error: OSError) -> None:
        with refusing_unreadable(f"{where}:{Path(error.filename).relative_to(root).as_posix()}"):
            raise error

    with refusing_unreadable(f"{where}:{content}"):
        is_folder = (root / content).is_dir()
    if not is_folder:
        yield content
        return
    for folder, subfolders, files in os.walk(root / content, followlinks=True, onerror=refuse):
        subfolders.sort()
        prefix = Path(folder).relative_to(root).as_posix()
        yield from (f"{prefix}/{file}" for file in sorted(files))


def _member(path: str, name: str, where: str) -> Member:
    try:
        data = read_file(path, where)
    except DataError as refusal:
        return Member(name, 0, memoryview(b""), refusal)
    return Member(name, len(data), memoryview(data))


def _from_archive(source: Path, container: Container, wanted: Callable[[str], bool]) -> Iterator[Member]:
    if is_unfinished(container.id):
        raise DataError(
            Reason.ARCHIVE_TRUNCATED,
            f"{container.id}: an archive must be complete, and by its name this is a download that was not finished; "
            "finish or repeat the download, or remove what is left of it",
        )
    roots: set[str] = set()

    def relative(name: str) -> str | None:
        """Name below the scene's own folder; None for what is hidden or lies outside of any folder."""
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if len(parts) < 2 or any(part.startswith(".") for part in parts):
            return None
        if parts[0] not in CONTENT_FOLDERS:
            roots.add(parts.pop(0))
        else:
            roots.add("")
        return "/".join(parts)

    def is_wanted(name: str) -> bool:
        inside = relative(name)
        return inside is not None and wanted(inside)

    for member in walk_tar(source / container.id, container.id, is_wanted):
        yield Member(relative(member.name) or member.name, member.size, member.data)
        if len(roots) > 1:
            break
    if len(roots) > 1:
        raise DataError(
            Reason.CONTAINER_SEVERAL_SCENES,
            f"{container.id}: all members of a scene archive must lie below one folder, found {sorted(roots)}; "
            "pack one scene an archive",
            {"roots": sorted(roots)},
        )
