"""The files of a folder as members, as an archive gives them: sorted, each read when its turn comes."""

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.member import Member
from wsm_data.readers.unreadable import read_file, refusing_unreadable


def walk_folder(
    root: Path,
    where: str,
    tops: Sequence[str],
    wanted: Callable[[str], bool],
    is_folder: Callable[[str], bool],
    max_bytes: int,
) -> Iterator[Member]:
    """Yield the wanted files below a folder, in sorted order within each of `tops`.

    A file that cannot be read is a member with a refusal: its frame is lost, others are not. Links are followed, but
    not into a folder that they lie in.

    Args:
        root: the folder.
        where: what to call it in messages.
        tops: names in it that are looked at, in this order; those that are not there are passed over.
        wanted: of a name relative to `root`, with `/`: whether its content is asked for.
        is_folder: of such a name, whether it must be a folder: one that looks like a file cannot be reached.
        max_bytes: larger files are members with a refusal, unread.

    Raises:
        DataError: `file.unreadable` when a folder cannot be listed or reached, `file.link_loop`.
    """
    with refusing_unreadable(where):
        present = {path.name for path in root.iterdir()}
    for top in (name for name in tops if name in present):
        for name in _names(root, top, where):
            if wanted(name):
                yield file_member(f"{root}/{name}", name, f"{where}:{name}", max_bytes)
            elif is_folder(name):
                with refusing_unreadable(f"{where}:{name}"):
                    (root / name).stat()


def file_member(path: str, name: str, where: str, max_bytes: int) -> Member:
    """A file as a member under the given name, with its content or the refusal of it."""
    try:
        data = read_file(path, where, max_bytes)
    except DataError as refusal:
        return Member(name, 0, memoryview(b""), refusal)
    return Member(name, len(data), memoryview(data))


def _names(root: Path, top: str, where: str) -> Iterator[str]:
    """Names of all files, in sorted order; a folder that cannot be reached looks like a file."""
    with refusing_unreadable(f"{where}:{top}"):
        is_folder = (root / top).is_dir()
    if is_folder:
        yield from _names_below(root, top, where, ())
    else:
        yield top


def _names_below(root: Path, folder: str, where: str, above: tuple[tuple[int, int], ...]) -> Iterator[str]:
    with refusing_unreadable(f"{where}:{folder}"):
        status = (root / folder).stat()
        with os.scandir(root / folder) as found:
            entries = sorted(((entry.name, _is_folder(entry)) for entry in found), key=lambda entry: entry[0])
    identity = (status.st_dev, status.st_ino)
    if identity in above:
        raise DataError(
            Reason.FILE_LINK_LOOP,
            f"{where}:{folder} must not be a link to a folder that it lies in, and it is one; remove the link",
            {"folder": folder},
        )
    yield from (f"{folder}/{name}" for name, is_folder in entries if not is_folder)
    for name in (name for name, is_folder in entries if is_folder):
        yield from _names_below(root, f"{folder}/{name}", where, (*above, identity))


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False
