"""Settings of access: how shards behind a URL reach this machine."""

from dataclasses import dataclass
from enum import StrEnum

from wsm_data.files.retries import RequestConfig


class RemoteAccess(StrEnum):
    """How shards behind a URL are read."""

    RANGES = "ranges"
    SHARDS = "shards"


@dataclass(frozen=True, kw_only=True)
class AccessConfig:
    """How the bytes of a release behind a URL are fetched; a release in a folder needs none of it.

    Attributes:
        access: single ranges, or whole shards into the cache.
        cache_dir: folder of the cache of whole shards; needed for `access = shards`.
        cache_gib: most bytes the cache may hold, GiB.
        fetch_threads: requests to a store at the same time.
        attempts: how often a request is tried before the run stops.
        first_backoff_s: pause after the first failed attempt, s; it doubles with each further one.
        request_timeout_s: longest time of one attempt for every 8 MiB asked for, or part of them, s.
    """

    access: RemoteAccess = RemoteAccess.RANGES
    cache_dir: str = ""
    cache_gib: float = 50.0
    fetch_threads: int = 8
    attempts: int = RequestConfig.attempts
    first_backoff_s: float = RequestConfig.first_backoff_s
    request_timeout_s: float = RequestConfig.timeout_s

    def __post_init__(self) -> None:
        object.__setattr__(self, "access", RemoteAccess(self.access))  # a word, as files and users spell it
