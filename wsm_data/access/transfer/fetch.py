"""A published release brought into a folder: compared with its manifest, which is written when all else is there."""

import hashlib
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from wsm_data.access.transfer.publish import Moved
from wsm_data.access.transfer.release_files import release_files
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import flush_folder, write_bytes
from wsm_data.files.digest import sha256_file
from wsm_data.files.retries import NOT_THERE
from wsm_data.files.stores import Store, open_store
from wsm_data.shards.names import MANIFEST_NAME, is_shard_name

_PART_BYTES = 8 << 20
_HASHED_BYTES = 4 << 20
_ARRIVING_SUFFIX = ".arriving"
_TRIES = 2  # what was damaged on the way comes whole the second time


def fetch_release(url: str, folder: Path, threads: int, on_progress: Callable[[int], object]) -> Moved:
    """Bring a release into a folder.

    What is there already with the right digest is left, a file that was cut goes on where it ends, and shards of
    another release are removed. Until the end there is no dataset.json, so that nothing takes the folder for a release.

    Args:
        url: the release.
        folder: where it goes.
        threads: requests at a time; each holds 8 MiB.
        on_progress: called with the bytes of each piece that is there.

    Raises:
        ConfigError: there is no release at the URL, or the folder holds other things.
        IntegrityError: a file of the store is not what the manifest vouches for, twice.
        StoreError: the store refuses, or failed in all attempts.
    """
    store = open_store(url)
    try:
        files = release_files(store)
    except NOT_THERE as error:
        raise ConfigError(f"there is no release at {url}: it must hold {MANIFEST_NAME}") from error
    _require_own(folder)
    (folder / MANIFEST_NAME).unlink(missing_ok=True)
    moved_files = moved_bytes = 0
    wanted: dict[str, str | None] = {**files.vouched, **dict.fromkeys(files.attached)}
    for name, sha256 in wanted.items():
        if moved := _fetch_file(store, name, folder / name, sha256, threads, on_progress):
            moved_files, moved_bytes = moved_files + 1, moved_bytes + moved
    for path in folder.iterdir():
        if is_shard_name(path.name) and path.name not in wanted:
            path.unlink()
    write_bytes(folder / MANIFEST_NAME, files.manifest_bytes)
    size = len(files.manifest_bytes)
    return Moved(files=len(wanted) + 1, moved_files=moved_files + 1, moved_bytes=moved_bytes + size)


def _require_own(folder: Path) -> None:
    """Refuse a folder in which nothing looks like a release that is being fetched."""
    try:
        found = {path.name for path in folder.iterdir()} if folder.exists() else set()
    except OSError as error:
        raise ConfigError(f"{folder} must be a folder that can be read: {error}") from error
    foreign = [
        name
        for name in found
        if not (name == MANIFEST_NAME or is_shard_name(name.removeprefix(".").removesuffix(_ARRIVING_SUFFIX)))
    ]
    if foreign and len(foreign) == len(found):
        raise ConfigError(f"{folder} must be empty or hold a release, found {', '.join(sorted(foreign)[:3])}")


def _fetch_file(
    store: Store, name: str, path: Path, sha256: str | None, threads: int, on_progress: Callable[[int], object]
) -> int:
    """Bring one file; returns the bytes that came over the network, 0 where it was there.

    What vouches for itself has no digest here: it comes anew each time, and whoever reads it compares it.
    """
    size = store.size_bytes(name)
    if sha256 and path.is_file() and path.stat().st_size == size and sha256_file(path) == sha256:
        on_progress(size)
        return 0
    path.parent.mkdir(parents=True, exist_ok=True)
    arriving = path.with_name(f".{path.name}{_ARRIVING_SUFFIX}")
    if sha256 is None:
        arriving.unlink(missing_ok=True)
    for _ in range(_TRIES):
        came, found = _go_on(store, name, arriving, size, threads, on_progress)
        if found == sha256 or sha256 is None:
            arriving.replace(path)
            flush_folder(path.parent)
            return came
        arriving.unlink()
    raise IntegrityError(
        f"{store.root}/{name} must have sha256 {sha256}, found {found} in the last of {_TRIES} downloads; publish the "
        "release again"
    )


def _go_on(
    store: Store, name: str, arriving: Path, size: int, threads: int, on_progress: Callable[[int], object]
) -> tuple[int, str]:
    """Complete a file that is arriving; returns the bytes that came, and the sha256 of all of it."""
    digest = hashlib.sha256()
    with arriving.open("a+b") as file:
        if file.seek(0, os.SEEK_END) > size:
            file.truncate(0)
        file.seek(0)
        while block := file.read(_HASHED_BYTES):
            digest.update(block)
        begin = file.tell()
        on_progress(begin)
        for part in _parts(store, name, begin, size, threads):
            digest.update(part)
            file.write(part)
            on_progress(len(part))
        file.flush()
        os.fsync(file.fileno())
    return size - begin, digest.hexdigest()


def _parts(store: Store, name: str, begin: int, size: int, threads: int) -> Iterator[bytes]:
    """The file from `begin` on, in order; the next parts are on their way while one is used."""
    underway: deque[Future[bytes]] = deque()
    with ThreadPoolExecutor(threads, thread_name_prefix="wsm-fetch") as pool:
        for offset in range(begin, size, _PART_BYTES):
            underway.append(pool.submit(store.read_range, name, offset, min(_PART_BYTES, size - offset)))
            if len(underway) == threads:
                yield underway.popleft().result()
        while underway:
            yield underway.popleft().result()
