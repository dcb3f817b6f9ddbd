"""Which reader the shards of a release need."""

from wsm_data.access.cached_shards import CachedShards
from wsm_data.access.config import AccessConfig, RemoteAccess
from wsm_data.access.local_shards import LocalShards
from wsm_data.access.ranges import RangeReader
from wsm_data.access.shard_reader import ShardReader
from wsm_data.files.stores import LocalStore, Store
from wsm_data.shards.manifest import ReleaseManifest


def open_shards(store: Store, manifest: ReleaseManifest, config: AccessConfig) -> ShardReader:
    """A reader of the shards of a release, by where they are.

    Raises:
        ConfigError: the settings do not fit a release behind a URL, such as a cache that could not hold a shard.
    """
    if isinstance(store, LocalStore):
        return LocalShards(store.root)
    if config.access is RemoteAccess.SHARDS:
        return CachedShards(store.root, manifest, config)
    return RangeReader(store.root, config)


def reads_again_what_it_read(store: Store, config: AccessConfig) -> bool:
    """Whether a clip comes from the same bytes each time, those of a disk or a cache, and not by a new transfer."""
    return isinstance(store, LocalStore) or config.access is RemoteAccess.SHARDS
