"""Which files a release consists of, in the order in which they are moved: dataset.json last."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsm_data.files.digest import sha256_bytes
from wsm_data.files.stores import Store
from wsm_data.shards.manifest import ReleaseManifest, parse_manifest
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, MANIFEST_NAME, QUARANTINE_NAME, SCORES_NAME
from wsm_data.shards.selection import selection_names, selection_path


@dataclass(frozen=True, kw_only=True)
class ReleaseFiles:
    """The files of a release.

    Attributes:
        manifest: dataset.json, parsed.
        manifest_bytes: dataset.json, as it stands.
        vouched: sha256 of every other file that it vouches for, by name.
        attached: scores and selections that stand in the release, which vouch for themselves.
    """

    manifest: ReleaseManifest
    manifest_bytes: bytes
    vouched: Mapping[str, str]
    attached: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Digest of the release."""
        return sha256_bytes(self.manifest_bytes)


def release_files(store: Store) -> ReleaseFiles:
    """The files of a finished release.

    Raises:
        IntegrityError: its manifest is not one of this schema version.
        FileNotFoundError: there is none.
    """
    data = store.read(MANIFEST_NAME)
    manifest = parse_manifest(data, f"{store.root}/{MANIFEST_NAME}")
    beside = {
        INDEX_NAME: manifest.index_sha256,
        INVENTORY_NAME: manifest.inventory_sha256,
        QUARANTINE_NAME: manifest.quarantine_sha256,
    }
    scores = (SCORES_NAME,) if store.exists(SCORES_NAME) else ()
    return ReleaseFiles(
        manifest=manifest,
        manifest_bytes=data,
        vouched={shard.name: shard.sha256 for shard in manifest.shards} | beside,
        attached=(*scores, *(selection_path(name) for name in selection_names(store))),
    )
