"""Where files are uploaded to: a folder of a store, which is believed only when it says what it holds."""

from typing import Protocol

from wsm_data.errors import StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.retries import NOT_THERE
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.files.uploads.hub_target import HUB_SCHEME, HubTarget
from wsm_data.files.uploads.local_file import LocalFile
from wsm_data.files.uploads.s3_target import S3Target


class Target(Protocol):
    """A folder of a store that takes files."""

    @property
    def store(self) -> FsspecStore:
        """The same folder, to read from."""

    def holds(self, name: str, file: LocalFile) -> bool:
        """Whether the store has exactly these bytes under this name, by its own checksum or by its bytes."""

    def put(self, name: str, file: LocalFile) -> None:
        """Upload a file; it counts as stored after `settle`. Several may be put at a time.

        Raises:
            StoreError: the store refuses, failed in all attempts, or holds other bytes afterwards.
        """

    def remove(self, name: str) -> None:
        """Take a file away; nothing where there is none. It counts after `settle`."""

    def settle(self) -> None:
        """Let what was put and removed be seen by everybody."""

    def checksum(self, name: str) -> str:
        """What the store itself says of the bytes of a file, such as `etag:...`; empty where it says nothing."""


def open_target(url: str) -> Target:
    """The folder at a URL.

    Raises:
        ConfigError: nothing can be uploaded to such a URL, or a package for it is not installed.
    """
    if url.startswith(HUB_SCHEME):
        return HubTarget(url)
    store = FsspecStore(url)
    return S3Target(store) if url.startswith(("s3://", "s3a://")) else FsspecTarget(store)


def send(target: Target, name: str, file: LocalFile) -> bool:
    """Upload a file where the store does not hold it already; returns whether it was sent.

    Raises:
        StoreError: there is no such bucket, or as `Target.put`.
    """
    if target.holds(name, file):
        return False
    try:
        target.put(name, file)
    except NOT_THERE as error:
        raise StoreError(f"{target.store.root} takes no files, as if there were no such bucket: {error}") from error
    return True
