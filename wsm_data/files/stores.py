"""Whole files and byte ranges, from a local folder or from any store that fsspec knows."""

import errno
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import fsspec
from fsspec.asyn import sync

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.retries import NOT_THERE, RequestConfig, ask, may_pass

_TIMED_BYTES = 8 << 20
_DEFAULT_REQUEST = RequestConfig()


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


class FsspecStore:
    """A folder behind any fsspec URL, such as s3://bucket/release or memory://release.

    Each store has a file system of its own, and another one in a forked process: those of fsspec do not survive a
    fork. No listing is kept, so what is asked is what the store answers now. The attempts that s3fs and botocore would
    make on their own (up to 25, one within the other) are switched off: `request` alone says how often a store is
    asked. Time limits hold for the file systems that fsspec runs asynchronously, among them S3, Google, Azure and HTTP;
    s3fs itself gives up a connection that is not made in 5 s, and one that falls silent for 15 s.
    """

    def __init__(self, root: str, request: RequestConfig = _DEFAULT_REQUEST):
        """Connect lazily to `root`.

        Args:
            root: URL of the folder.
            request: how the store is asked.

        Raises:
            ConfigError: fsspec does not know such URLs, or needs a package for them that is not installed.
        """
        self.root = root
        self.request = request
        self._process = os.getpid()
        self._filesystem, base = _connect(root, request)
        self._base = base.rstrip("/")

    def __reduce__(self) -> tuple[type["FsspecStore"], tuple[str, RequestConfig]]:
        """Cross a process boundary as a name; the other side connects anew."""
        return FsspecStore, (self.root, self.request)

    def exists(self, name: str) -> bool:
        """Whether the file is there."""
        try:
            return bool(self._info(name)["type"] == "file")
        except NOT_THERE:
            return False

    def size_bytes(self, name: str) -> int:
        """Size of the file."""
        return int(self._info(name)["size"])

    def names(self) -> list[str]:
        """Names of the files directly below the root, sorted."""
        entries = ask(lambda: self._call("ls", self._base, detail=True), self.root, self.request)
        return sorted(str(entry["name"]).rsplit("/", 1)[-1] for entry in entries if entry["type"] == "file")

    def read(self, name: str) -> bytes:
        """The whole file."""
        return ask(lambda: self._try_all(name), f"{self.root}/{name}", self.request)

    def read_range(self, name: str, offset: int, size: int) -> bytes:
        """`size` bytes from `offset`; fewer only where the file ends earlier."""
        if size <= 0:
            return b""  # a range of no bytes cannot be said in HTTP
        where = f"{self.root}/{name}"
        try:
            return ask(lambda: self._try_range(name, offset, size), where, self.request)
        except StoreError as error:
            if error.__cause__ is None or may_pass(error.__cause__) or offset < self.size_bytes(name):
                raise
            return b""  # some stores refuse a range that starts behind the end

    def _try_range(self, name: str, offset: int, size: int) -> bytes:
        data = bytes(self._call("cat_file", f"{self._base}/{name}", size_bytes=size, start=offset, end=offset + size))
        if len(data) > size:
            raise OSError(errno.EINVAL, f"{len(data)} bytes came where {size} were asked for: it does not serve ranges")
        if len(data) < size:
            end = min(offset + size, int(self._call("info", f"{self._base}/{name}")["size"]))
            _require_length(data, max(0, end - offset))
        return data

    def _try_all(self, name: str) -> bytes:
        size = self._call("info", f"{self._base}/{name}")["size"]  # None where a server does not say
        data = bytes(self._call("cat_file", f"{self._base}/{name}", size_bytes=size or 0))
        _require_length(data, len(data) if size is None else int(size))
        return data

    def _info(self, name: str) -> dict[str, Any]:
        return ask(lambda: self._call("info", f"{self._base}/{name}"), f"{self.root}/{name}", self.request)

    def _call(self, method: str, path: str, size_bytes: int = 0, **arguments: object) -> Any:
        """Call a method of the file system, within the time that this many bytes may take."""
        if self._process != os.getpid():
            self._process = os.getpid()
            self._filesystem, _ = _connect(self.root, self.request)
        filesystem = self._filesystem
        if not filesystem.async_impl:
            return getattr(filesystem, method)(path, **arguments)
        timeout_s = self.request.timeout_s * max(1, -(-size_bytes // _TIMED_BYTES))
        return sync(filesystem.loop, getattr(filesystem, f"_{method}"), path, timeout=timeout_s, **arguments)


def _require_length(data: bytes, size: int) -> None:
    if len(data) != size:
        raise OSError(errno.EIO, f"the body has {len(data)} bytes, and must have {size}")


def _connect(root: str, request: RequestConfig) -> tuple[Any, str]:
    """A file system that shares nothing with others, and the path of `root` in it."""
    options: dict[str, object] = {"skip_instance_cache": True, "use_listings_cache": False}
    is_s3 = root.startswith(("s3://", "s3a://"))
    if is_s3:
        settings = fsspec.config.conf.get("s3", {}).get("config_kwargs", {})
        limits = {"retries": {"total_max_attempts": 1}, "max_pool_connections": request.connections}
        options["config_kwargs"] = {**settings, **limits}
    try:
        filesystem, path = fsspec.core.url_to_fs(root, **options)
    except (ImportError, ValueError) as error:
        raise ConfigError(f"{root} cannot be opened: {error}") from error
    if is_s3:
        filesystem.retries = 1
    return filesystem, path


def is_url(location: str | Path) -> bool:
    """Whether a location is an fsspec URL (anything with `://`), and no local path."""
    return "://" in str(location)


def open_store(location: str | Path) -> Store:
    """Return the store at a local path or at an fsspec URL.

    Raises:
        ConfigError: fsspec does not know such URLs, or needs a package for them that is not installed.
    """
    text = str(location)
    return FsspecStore(text) if is_url(text) else LocalStore(text)
