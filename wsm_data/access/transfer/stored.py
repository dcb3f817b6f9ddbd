"""Whether a release behind a URL is what was published, without reading its shards."""

from collections.abc import Iterator
from dataclasses import dataclass

from wsm_data.access.transfer.published import PublishedFile, read_published
from wsm_data.access.transfer.release_files import ReleaseFiles, release_files
from wsm_data.access.verify import check_beside_shards
from wsm_data.errors import IntegrityError
from wsm_data.files.locations import is_url
from wsm_data.files.stores import Store, open_store
from wsm_data.files.uploads.target import open_target
from wsm_data.shards.findings import Finding, FindingKind


@dataclass(frozen=True, kw_only=True)
class StoredCheck:
    """What was looked at, and what is wrong.

    Attributes:
        findings: what is wrong; empty for a sound release.
        shards: how many there must be.
        by_checksum: of how many the store's own checksum was compared with that of the time of publishing.
    """

    findings: tuple[Finding, ...]
    shards: int
    by_checksum: int


def check_stored(location: str) -> StoredCheck:
    """Compare the sizes of all shards with the manifest, the store's checksums with those it stated when it took them.

    Index, inventory and quarantine are read whole, and their counts compared, as `verify_release` does; no shard is
    read.

    Raises:
        ConfigError: there is no such folder.
    """
    store = open_store(location)
    try:
        files = release_files(store)
        beside = check_beside_shards(store, files.manifest)[1]
        said = _said(store, files)
    except IntegrityError as error:
        finding = Finding(kind=FindingKind.RELEASE_UNREADABLE, message=str(error))
        return StoredCheck(findings=(finding,), shards=0, by_checksum=0)
    found = [*beside, *_sizes(store, files), *_checksums(location, said)]
    return StoredCheck(findings=tuple(found), shards=len(files.manifest.shards), by_checksum=len(said))


def _sizes(store: Store, files: ReleaseFiles) -> Iterator[Finding]:
    for shard in files.manifest.shards:
        try:
            found = store.size_bytes(shard.name)
        except FileNotFoundError:
            message = f"the shard of {shard.clips} clips must be at {store.root}, but is missing; publish it again"
            yield Finding(kind=FindingKind.SHARD_MISSING, shard=shard.name, message=message)
            continue
        if found != shard.bytes:
            message = f"{shard.name} must have {shard.bytes} bytes, found {found}; publish it again"
            yield Finding(kind=FindingKind.SHARD_SIZE, shard=shard.name, message=message)


def _said(store: Store, files: ReleaseFiles) -> dict[str, PublishedFile]:
    """What the store said of each shard when it took it; nothing where it says nothing, or nobody asked."""
    published = read_published(store) if is_url(store.root) else None
    if published is None or published.release != files.digest:
        return {}
    shards = {shard.name for shard in files.manifest.shards}
    return {name: one for name, one in published.files.items() if one.checksum and name in shards}


def _checksums(location: str, said: dict[str, PublishedFile]) -> Iterator[Finding]:
    target = open_target(location) if said else None
    for name, stated in said.items():
        found = target.checksum(name) if target else ""
        if found and found != stated.checksum:  # what is missing was found by its size
            message = f"the store must say {stated.checksum} of it, as when it was published, and says {found}"
            yield Finding(kind=FindingKind.SHARD_CHANGED, shard=name, message=f"{message}; publish it again")
