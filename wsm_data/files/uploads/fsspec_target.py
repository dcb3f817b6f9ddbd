"""Files put into any store of fsspec. It says nothing of their bytes that could be relied on, so they are read back."""

import hashlib

from wsm_data.errors import StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.uploads.local_file import LocalFile

_READ_BACK_BYTES = 16 << 20


class FsspecTarget:
    """A folder behind a URL."""

    def __init__(self, store: FsspecStore):
        """Upload to the folder of `store`."""
        self.store = store

    def holds(self, name: str, file: LocalFile) -> bool:
        """Whether the store has exactly these bytes; they are read."""
        if not self.store.exists(name) or self.store.size_bytes(name) != file.size_bytes:
            return False
        digest = hashlib.sha256()
        for offset in range(0, file.size_bytes, _READ_BACK_BYTES):
            digest.update(self.store.read_range(name, offset, _READ_BACK_BYTES))
        return digest.hexdigest() == file.sha256

    def put(self, name: str, file: LocalFile) -> None:
        """Upload a file, and read it back.

        Raises:
            StoreError: the store refuses, failed in all attempts, or holds other bytes afterwards.
        """
        self.store.put_file(name, file.path)
        if not self.holds(name, file):
            raise differs(self.store, name, file)

    def remove(self, name: str) -> None:
        """Take a file away; nothing where there is none."""
        if self.store.exists(name):
            self.store.call("rm_file", name)

    def settle(self) -> None:
        """Nothing: what is put is seen at once."""

    def checksum(self, name: str) -> str:
        """Nothing: what such stores say of their files cannot be compared."""
        del name
        return ""


def differs(store: FsspecStore, name: str, file: LocalFile) -> StoreError:
    """What is said where a store does not hold what it took."""
    return StoreError(
        f"{store.root}/{name} must hold the {file.size_bytes} bytes of {file.path} after its upload, and holds others; "
        "was it written by somebody else at the same time? Run the same command again"
    )
