"""Proof that a release is whole: every file, clip, member and header, and that nothing was lost on the way."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from wsm_data.access.release import read_manifest
from wsm_data.access.verify_shard import verify_shard
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import sha256_bytes
from wsm_data.files.stores import Store, open_store
from wsm_data.shards.conservation import check_conservation, check_counts
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.index.table import IndexTable, parse_index
from wsm_data.shards.inventory import parse_inventory, parse_quarantine
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, QUARANTINE_NAME

Parsed = TypeVar("Parsed")


def verify_release(location: str | Path, on_progress: Callable[[int], None] | None = None) -> list[Finding]:
    """Check a release at a path or URL: every shard is read once, in constant memory.

    Args:
        location: the folder that holds dataset.json.
        on_progress: called with the number of shard bytes just read; they add up to the size of the shards.

    Returns:
        What is wrong; empty for a sound release.

    Raises:
        ConfigError: there is no such folder.
    """
    store = open_store(location)
    try:
        manifest = read_manifest(store)
    except IntegrityError as error:
        return [Finding(kind=FindingKind.RELEASE_UNREADABLE, message=str(error))]
    return list(_findings(store, manifest, on_progress or _ignore))


def check_beside_shards(store: Store, manifest: ReleaseManifest) -> tuple[IndexTable | None, list[Finding]]:
    """The index, as far as it can be read, and what is wrong beside the shards, none of which is read."""
    found: list[Finding] = []
    index = _load(store, INDEX_NAME, manifest.index_sha256, parse_index, found)
    inventory = _load(store, INVENTORY_NAME, manifest.inventory_sha256, parse_inventory, found)
    quarantine = _load(store, QUARANTINE_NAME, manifest.quarantine_sha256, parse_quarantine, found)
    if index is not None and inventory is not None:
        found += check_counts(manifest, index, inventory)
        if quarantine is not None:
            found += check_conservation(manifest, index, inventory, quarantine)
    return index, [*found, *_unlisted(store, manifest)]


def _findings(store: Store, manifest: ReleaseManifest, on_progress: Callable[[int], None]) -> Iterator[Finding]:
    index, beside = check_beside_shards(store, manifest)
    yield from beside
    for shard in manifest.shards:
        rows_faults: list[Finding] = []
        rows = _rows(index, shard, rows_faults)
        yield from rows_faults
        yield from verify_shard(store, shard, rows, manifest, on_progress)


def _load(
    store: Store, name: str, sha256: str, parse: Callable[[bytes, str], Parsed], faults: list[Finding]
) -> Parsed | None:
    """Read and parse a file beside the shards; what is wrong with it is added to `faults`.

    A changed file is used as far as it can be read: what it says of clips and units locates the damage.
    """
    where = f"{store.root}/{name}"
    if not store.exists(name):
        faults.append(Finding(kind=FindingKind.FILE_CHANGED, message=f"{where} is missing; fetch it again"))
        return None
    data = store.read(name)
    found = sha256_bytes(data)
    if found != sha256:
        message = f"{where} must have sha256 {sha256}, found {found}; fetch it again"
        faults.append(Finding(kind=FindingKind.FILE_CHANGED, message=message))
    try:
        return parse(data, where)
    except IntegrityError as error:
        faults.append(Finding(kind=FindingKind.FILE_CHANGED, message=str(error)))
        return None


def _rows(index: IndexTable | None, shard: ShardInfo, faults: list[Finding]) -> list[IndexRow] | None:
    try:
        return None if index is None else list(index.rows_of_shard(shard.name))
    except IntegrityError as error:
        faults.append(Finding(kind=FindingKind.SHARD_LAYOUT, shard=shard.name, message=str(error)))
        return None


def _unlisted(store: Store, manifest: ReleaseManifest) -> Iterator[Finding]:
    listed = {shard.name for shard in manifest.shards}
    for name in store.names():
        if name.endswith(".tar") and name not in listed:
            message = f"{name} is not a shard of this release; remove it, or pack again"
            yield Finding(kind=FindingKind.SHARD_UNLISTED, shard=name, message=message)


def _ignore(count: int) -> None:
    del count
