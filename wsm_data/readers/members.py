"""The files of a container under names that do not say how it is stored: `data/...`, `meta/...`, `videos/...`."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.containers import CONTENT_FOLDERS, Container, Layout
from wsm_data.readers.tar_walk import Member, walk_tar


def iter_members(source: Path, container: Container, wanted: Callable[[str], bool]) -> Iterator[Member]:
    """Yield the wanted files of a container, named relative to the root of its scene or trajectory.

    Archives come in stored order, folders in sorted order; nothing may depend on either. An archive of trajectory
    folders gives `<trajectory>/data/...` and so on. A member's data is valid until the next member is asked for.

    Raises:
        DataError: an `archive.*` reason, or `container.several_scenes`.
    """
    if container.layout is Layout.SCENE_ARCHIVE:
        yield from _from_archive(source, container, wanted)
    else:
        yield from _from_folder(source / container.path, wanted)


def _from_folder(root: Path, wanted: Callable[[str], bool]) -> Iterator[Member]:
    for content in CONTENT_FOLDERS:
        for folder, subfolders, files in os.walk(root / content, followlinks=True):
            subfolders.sort()
            prefix = Path(folder).relative_to(root).as_posix()
            for file in sorted(files):
                name = f"{prefix}/{file}"
                if wanted(name):
                    data = (root / name).read_bytes()
                    yield Member(name, len(data), memoryview(data))


def _from_archive(source: Path, container: Container, wanted: Callable[[str], bool]) -> Iterator[Member]:
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

    for member in walk_tar(source / container.path, container.id, is_wanted):
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
