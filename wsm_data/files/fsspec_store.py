"""Files behind a URL, read with attempts and time limits."""

import asyncio
import errno
import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any

import fsspec

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.locations import require_no_secret
from wsm_data.files.retries import NOT_THERE, Answer, RequestConfig, ask, may_pass

_TIMED_BYTES = 8 << 20
_DEFAULT_REQUEST = RequestConfig()


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
            ConfigError: fsspec does not know such URLs, needs a package for them that is not installed, or it holds
                credentials.
        """
        require_no_secret(root)
        self.root = root
        self.request = request
        self._connect()

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
        entries = self._ask(lambda: self._call("ls", self._base, detail=True), "")
        return sorted(str(entry["name"]).rsplit("/", 1)[-1] for entry in entries if entry["type"] == "file")

    def read(self, name: str) -> bytes:
        """The whole file."""
        return self._ask(lambda: self._try_all(name), name)

    def read_range(self, name: str, offset: int, size: int) -> bytes:
        """`size` bytes from `offset`; fewer only where the file ends earlier."""
        if size <= 0:
            return b""  # a range of no bytes cannot be said in HTTP
        try:
            return self._ask(lambda: self._try_range(name, offset, size), name)
        except StoreError as error:
            if error.__cause__ is None or may_pass(error.__cause__) or offset < self.size_bytes(name):
                raise
            return b""  # some stores refuse a range that starts behind the end

    def put_file(self, name: str, path: Path) -> None:
        """Upload a file of this machine, replacing what was there."""
        there = f"{self._base}/{name}"
        self._ask(lambda: self._call("put_file", str(path), there, size_bytes=path.stat().st_size), name)

    def call(self, method: str, name: str) -> Any:
        """What a method of fsspec's file system says of a file, or does with it."""
        return self._ask(lambda: self._call(method, f"{self._base}/{name}"), name)

    def call_s3(self, operation: str, name: str, *, size_bytes: int = 0, **arguments: object) -> Any:
        """Call an operation of S3 by its name in boto3, in the bucket of this folder.

        Args:
            operation: such as `create_multipart_upload`.
            name: the file that it is about, for messages.
            size_bytes: bytes that are sent, by which the time limit grows.
            **arguments: of the operation, without `Bucket`.
        """
        bucket = self._base.partition("/")[0]
        return self._ask(
            lambda: self._call("call_s3", operation, size_bytes=size_bytes, Bucket=bucket, **arguments), name
        )

    def s3_key(self, name: str) -> str:
        """What S3 calls a file in the bucket of this folder."""
        return f"{self._base}/{name}".partition("/")[2]

    def close(self) -> None:
        """Give up what is being asked, in whatever thread: whoever waits for it gets a StoreError."""
        self._closed.set()
        for future in tuple(self._in_flight):
            future.cancel()

    def _connect(self) -> None:
        self._process = os.getpid()
        self._closed = threading.Event()
        self._in_flight: set[Future[Any]] = set()
        self._filesystem, base = _own_filesystem(self.root, self.request)
        self._base = base.rstrip("/")

    def _ask(self, request: Callable[[], Answer], name: str) -> Answer:
        where = f"{self.root}/{name}" if name else self.root
        try:
            return ask(request, where, self.request, self._pause)
        except CancelledError as error:
            raise self._is_closed() from error

    def _pause(self, pause_s: float) -> None:
        if self._closed.wait(pause_s):
            raise self._is_closed()

    def _is_closed(self) -> StoreError:
        return StoreError(f"{self.root}: the store was closed while it was being asked; open it again")

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
        return self._ask(lambda: self._call("info", f"{self._base}/{name}"), name)

    def _call(self, method: str, *paths: str, size_bytes: int = 0, **arguments: object) -> Any:
        """Call a method of the file system, within the time that this many bytes may take."""
        if self._process != os.getpid():
            self._connect()
        if self._closed.is_set():
            raise self._is_closed()
        filesystem = self._filesystem
        if not filesystem.async_impl:
            return getattr(filesystem, method)(*paths, **arguments)
        timeout_s = self.request.timeout_s * max(1, -(-size_bytes // _TIMED_BYTES))
        answer = asyncio.wait_for(getattr(filesystem, f"_{method}")(*paths, **arguments), timeout_s)
        future = asyncio.run_coroutine_threadsafe(answer, filesystem.loop)
        self._in_flight.add(future)
        if self._closed.is_set():  # since it was looked at above
            future.cancel()
        try:
            return future.result()
        finally:
            self._in_flight.discard(future)


def _require_length(data: bytes, size: int) -> None:
    if len(data) != size:
        raise OSError(errno.EIO, f"the body has {len(data)} bytes, and must have {size}")


def _own_filesystem(root: str, request: RequestConfig) -> tuple[Any, str]:
    """A file system that shares nothing with others, and the path of `root` in it."""
    options: dict[str, object] = {"skip_instance_cache": True, "use_listings_cache": False}
    is_s3 = root.startswith(("s3://", "s3a://"))
    if is_s3:
        settings = fsspec.config.conf.get("s3", {}).get("config_kwargs", {})
        limits = {"retries": {"total_max_attempts": 1}, "max_pool_connections": request.connections}
        options["config_kwargs"] = {**settings, **limits}
    if root.startswith("file://"):
        options["auto_mkdir"] = True  # of what is uploaded; other stores have no folders, or make them
    try:
        filesystem, path = fsspec.core.url_to_fs(root, **options)
    except (ImportError, ValueError) as error:
        raise ConfigError(f"{root} cannot be opened: {error}") from error
    if is_s3:
        filesystem.retries = 1
    return filesystem, path
