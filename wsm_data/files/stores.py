"""Whole files and byte ranges, from a local folder or from any store that fsspec knows."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.locations import is_url


class Store(Protocol):
    """A folder of immutable files, read by name relative to its root.

    A file that is not there is a FileNotFoundError; a remote store that refuses or fails for good is a StoreError.
    """

    @property
    def root(self) -> str:
        """Path or URL of the folder."""

    def exists(self, name: str) -> bool:
        """Whether the file is there."""

    def size_bytes(self, name: str) -> int:
        """Size of the file."""

    def names(self) -> list[str]:
        """Names of the files directly below the root, sorted."""

    def read(self, name: str) -> bytes:
        """The whole file."""

    def read_range(self, name: str, offset: int, size: int) -> bytes:
        """`size` bytes from `offset`; fewer only where the file ends earlier."""


@dataclass(frozen=True)
class LocalStore:
    """A folder on this machine."""

    root: str

    def exists(self, name: str) -> bool:
        """Whether the file is there."""
        return (Path(self.root) / name).is_file()

    def size_bytes(self, name: str) -> int:
        """Size of the file."""
        return (Path(self.root) / name).stat().st_size

    def names(self) -> list[str]:
        """Names of the files directly below the root, sorted."""
        return sorted(entry.name for entry in Path(self.root).iterdir() if entry.is_file())

    def read(self, name: str) -> bytes:
        """The whole file."""
        return (Path(self.root) / name).read_bytes()

    def read_range(self, name: str, offset: int, size: int) -> bytes:
        """`size` bytes from `offset`; fewer only where the file ends earlier."""
        with (Path(self.root) / name).open("rb") as file:
            file.seek(offset)
            return file.read(size)


def open_store(location: str | Path) -> Store:
    """Return the store at a local path or at an fsspec URL.

    Raises:
        ConfigError: fsspec does not know such URLs, or needs a package for them that is not installed.
    """
    text = str(location)
    return FsspecStore(text) if is_url(text) else LocalStore(text)
