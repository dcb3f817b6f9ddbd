"""Whole files and byte ranges, from a local folder or from any store that fsspec knows."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import fsspec


class Store(Protocol):
    """A folder of immutable files, read by name relative to its root."""

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


class FsspecStore:
    """A folder behind any fsspec URL, such as s3://bucket/release or memory://release."""

    def __init__(self, root: str):
        self.root = root
        self._filesystem, base = fsspec.core.url_to_fs(root)
        self._base = base.rstrip("/")

    def exists(self, name: str) -> bool:
        """Whether the file is there."""
        return bool(self._filesystem.isfile(f"{self._base}/{name}"))

    def size_bytes(self, name: str) -> int:
        """Size of the file."""
        return int(self._filesystem.size(f"{self._base}/{name}"))

    def names(self) -> list[str]:
        """Names of the files directly below the root, sorted."""
        entries = self._filesystem.ls(self._base, detail=True)
        return sorted(str(entry["name"]).rsplit("/", 1)[-1] for entry in entries if entry["type"] == "file")

    def read(self, name: str) -> bytes:
        """The whole file."""
        return bytes(self._filesystem.cat_file(f"{self._base}/{name}"))

    def read_range(self, name: str, offset: int, size: int) -> bytes:
        """`size` bytes from `offset`; fewer only where the file ends earlier."""
        return bytes(self._filesystem.cat_file(f"{self._base}/{name}", start=offset, end=offset + size))


def open_store(location: str | Path) -> Store:
    """Return the store at a local path or at an fsspec URL (anything with `://`)."""
    text = str(location)
    return FsspecStore(text) if "://" in text else LocalStore(text)
