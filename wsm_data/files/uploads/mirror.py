"""A folder of a run kept behind a URL: what another machine needs to go on, with a list of it that comes last."""

import hashlib
import json
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import TypeVar

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.retries import NOT_THERE
from wsm_data.files.sealed import sealed, unsealed
from wsm_data.files.stores import Store, open_store
from wsm_data.files.uploads.local_file import look_at
from wsm_data.files.uploads.target import open_target, send

MIRROR_NAME = "mirror.json"
_THREADS = 8
_PART_BYTES = 64 << 20
_READ_BYTES = 16 << 20

Item = TypeVar("Item")
Answer = TypeVar("Answer")


@dataclass(frozen=True, kw_only=True)
class Mirror:
    """What a folder behind a URL holds.

    Attributes:
        files: sha256 of each file, by its name relative to the folder.
    """

    files: Mapping[str, str]


def send_folder(folder: Path, url: str, last: tuple[str, ...] = ()) -> int:
    """Bring a folder behind a URL up to date with the one here; returns how many files were sent.

    Hidden files stay here. The list is withdrawn before anything changes and comes when all else is compared, so that
    a folder with a list is one that was whole here at some time.

    Args:
        folder: a folder of this machine that nobody writes.
        url: where it goes.
        last: names of files that readers take for a sign that those beside them are there; they go up after all others.

    Raises:
        StoreError: the store refuses, failed in all attempts, or holds other bytes than it was sent.
    """
    target = open_target(url)
    old = _mirror(target.store)
    names = sorted(_visible(folder), key=lambda name: (PurePosixPath(name).name in last, name))
    early = [name for name in names if PurePosixPath(name).name not in last]
    looked = dict(zip(names, _side_by_side(lambda name: look_at(folder / name, _PART_BYTES), names), strict=True))
    new = Mirror(files={name: file.sha256 for name, file in sorted(looked.items())})
    if old == new:
        return 0
    for name in (MIRROR_NAME, *sorted(old.files.keys() - new.files.keys() if old else ())):
        target.remove(name)
    sent = sum(_side_by_side(lambda name: send(target, name, looked[name]), early))
    target.settle()
    sent += sum(send(target, name, looked[name]) for name in names[len(early) :])
    target.settle()
    with TemporaryDirectory(prefix="wsm-mirror-") as scratch:
        path = Path(scratch, MIRROR_NAME)
        path.write_text(json.dumps(sealed(to_json(new)), indent=2, sort_keys=True) + "\n")
        target.put(MIRROR_NAME, look_at(path, _PART_BYTES))
        target.settle()
    return sent


def bring_folder(url: str, folder: Path) -> int:
    """Bring what is kept behind a URL into a folder; returns how many files came, 0 where nothing is kept there.

    Raises:
        IntegrityError: a file has not the sha256 of the list, or the list was changed.
        StoreError: the store refuses, or failed in all attempts.
    """
    store = open_store(url)
    mirror = _mirror(store)
    if mirror is None:
        return 0
    _side_by_side(lambda name: _bring(store, name, folder / name, mirror.files[name]), sorted(mirror.files))
    return len(mirror.files)


def _visible(folder: Path) -> list[str]:
    found = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return [path.as_posix() for path in found if not any(part.startswith(".") for part in path.parts)]


def _mirror(store: Store) -> Mirror | None:
    try:
        data = store.read(MIRROR_NAME)
    except NOT_THERE:
        return None
    try:
        mirror = from_json(Mirror, unsealed(json.loads(data)))
        if any(PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts for name in mirror.files):
            raise ValueError("a name leads out of the folder")
    except ValueError as error:
        raise IntegrityError(
            f"{store.root}/{MIRROR_NAME} must list what is kept there, but: {error}; remove the folder there, and run "
            "the same command again"
        ) from error
    return mirror


def _bring(store: Store, name: str, path: Path, sha256: str) -> None:
    digest = hashlib.sha256()
    size = store.size_bytes(name)
    with atomic_file(path) as file:
        for offset in range(0, size, _READ_BYTES):
            part = store.read_range(name, offset, _READ_BYTES)
            digest.update(part)
            file.write(part)
        if digest.hexdigest() != sha256:
            raise IntegrityError(
                f"{store.root}/{name} must have sha256 {sha256}, found {digest.hexdigest()}; remove the folder of this "
                "stage there, and run the same command again"
            )


def _side_by_side(work: Callable[[Item], Answer], items: list[Item]) -> list[Answer]:
    with ThreadPoolExecutor(_THREADS, thread_name_prefix="wsm-mirror") as pool:
        try:
            return list(pool.map(work, items))
        finally:
            pool.shutdown(cancel_futures=True)
