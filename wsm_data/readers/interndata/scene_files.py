"""The files of a container under names that do not say how it is stored: `data/...`, `meta/...`, `videos/...`."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from itertools import takewhile
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.folder_walk import file_member, walk_folder
from wsm_data.readers.archive.member import Member
from wsm_data.readers.archive.tar_stream import PACK_ANEW
from wsm_data.readers.archive.tar_walk import walk_tar
from wsm_data.readers.interndata.containers import (
    CONTENT_FOLDERS,
    EXPECTS,
    SCENE_CLOUD,
    Place,
    is_part,
    is_unfinished,
    place_of,
)
from wsm_data.readers.source import Container
from wsm_data.schema.source.layout import Layout

_READ_FOLDER = re.compile(r"data|meta|videos|(data|videos)/[^/]+|videos/[^/]+/observation\.images\.(rgb|depth)")


def iter_members(source: Path, container: Container, wanted: Callable[[str], bool], max_bytes: int) -> Iterator[Member]:
    """Yield the wanted files of a container, named relative to the root of its scene or trajectory.

    Archives come in stored order, folders in sorted order; nothing may depend on either. An archive of trajectory
    folders gives `<trajectory>/data/...` and so on. A member's data is valid until the next member is asked for. A file
    of a folder that cannot be read is a member with a refusal: its frame is lost, others are not. So is one
    of more than `max_bytes`. `wanted` is asked about every file that is not hidden.

    Raises:
        DataError: an `archive.*` reason, `container.several_scenes`, `container.misplaced`, or a `file.*` reason.
    """
    if container.layout == Layout.SCENE_ARCHIVE:
        yield from _from_archive(source, container, wanted, max_bytes)
    else:
        root = source / container.id
        yield from walk_folder(root, container.id, CONTENT_FOLDERS, wanted, _is_read_folder, max_bytes)


def _is_read_folder(name: str) -> bool:
    return _READ_FOLDER.fullmatch(name) is not None


def scene_cloud(source: Path, container: Container, max_bytes: int) -> Member | None:
    """The cloud of the scene that a trajectory folder lies in; None where the scene has none."""
    path = (source / container.id).parent / SCENE_CLOUD
    if not os.path.lexists(path):
        return None
    return file_member(str(path), f"../{SCENE_CLOUD}", f"{container.id}:../{SCENE_CLOUD}", max_bytes)


def _from_archive(
    source: Path, container: Container, wanted: Callable[[str], bool], max_bytes: int
) -> Iterator[Member]:
    _require_readable_form(container.id)
    place = place_of(container)
    roots: set[str] = set()

    def relative(name: str) -> str | None:
        """Name below the scene's own folder; None for what is hidden."""
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if not parts or any(part.startswith(".") for part in parts):
            return None
        if len(parts) > 1:
            depth = _scene_depth(parts[:-1], place)
            roots.add("/".join(parts[:depth]))
            parts = parts[depth:]
        return "/".join(parts)

    def is_wanted(name: str) -> bool:
        inside = relative(name)
        return inside is not None and wanted(inside)

    for member in walk_tar(source / container.id, container.id, is_wanted, max_bytes):
        yield Member(relative(member.name) or member.name, member.size, member.data, member.refusal)
        if len(roots) > 1:
            break
    if len(roots) > 1:
        raise DataError(
            Reason.CONTAINER_SEVERAL_SCENES,
            f"{container.id}: all members of a scene archive must lie below one folder, found {sorted(roots)}; "
            "pack one scene an archive",
            {"roots": sorted(roots)},
        )


def _scene_depth(folders: Sequence[str], place: Place) -> int:
    """How many of the folders around a member lead to its scene, the scene's own included.

    The scene's folder may have any name, or be left out. It may lie in that of its group, or deeper, where it has the
    archive's name; or in that of its group under any name.
    """
    around = list(takewhile(lambda folder: folder not in CONTENT_FOLDERS, folders))
    if place.scene in around:
        return len(around) - around[::-1].index(place.scene)
    if place.group in around:
        return min(around.index(place.group) + 2, len(around))
    return min(len(around), 1)


def _require_readable_form(name: str) -> None:
    if name.count("/") != 1:
        raise DataError(
            Reason.CONTAINER_MISPLACED,
            f"{name}: a scene archive must lie in the folder of its group, as <group>/<scene>.tar.gz; move it "
            f"there, or correct the source: it is the folder that holds the groups, with {EXPECTS} below it",
        )
    if is_unfinished(name):
        raise DataError(
            Reason.ARCHIVE_TRUNCATED,
            f"{name}: an archive must be complete, and by its name this is a download that was not finished; "
            "finish or repeat the download, or remove what is left of it",
        )
    if is_part(name):
        raise DataError(
            Reason.ARCHIVE_UNREAD_FORM,
            f"{name}: an archive must be one file, and by its name this is a piece of one that was split; join them "
            f"with `cat <scene>.tar.gz.* > <scene>.tar.gz`, or {PACK_ANEW}",
        )
