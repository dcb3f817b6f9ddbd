"""The files of a container under names that do not say how it is stored: `data/...`, `meta/...`, `videos/...`."""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.folder_walk import file_member, walk_folder
from wsm_data.readers.archive.member import Member
from wsm_data.readers.archive.tar_walk import walk_tar
from wsm_data.readers.interndata.containers import CONTENT_FOLDERS, SCENE_CLOUD, is_unfinished
from wsm_data.readers.source import Container
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
        root = source / container.id
        yield from walk_folder(
            root, container.id, CONTENT_FOLDERS, wanted, lambda name: bool(_READ_FOLDER.fullmatch(name))
        )


def scene_cloud(source: Path, container: Container) -> Member | None:
    """The cloud of the scene that a trajectory folder lies in; None where the scene has none."""
    path = (source / container.id).parent / SCENE_CLOUD
    if not os.path.lexists(path):
        return None
    return file_member(str(path), f"../{SCENE_CLOUD}", f"{container.id}:../{SCENE_CLOUD}")


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
