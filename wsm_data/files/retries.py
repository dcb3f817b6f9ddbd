"""Asking a store again where a failure may pass, and saying clearly what failed where it does not.

A request fails for good when the same request would fail again: nothing is there, access is refused, the request is
malformed. Everything else (a reset or refused connection, a body cut short, a timeout, a 5xx answer, SlowDown) may
pass, and is asked again after a pause that doubles from one attempt to the next.
"""

import errno
import logging
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from wsm_data.errors import StoreError

_LOGGER = logging.getLogger(__name__)
_LONGEST_BACKOFF_S = 30.0

Answer = TypeVar("Answer")

NOT_THERE = (FileNotFoundError, NotADirectoryError)
"""The errors by which a store says that there is no such file or folder."""

_LASTING = (PermissionError, FileExistsError, IsADirectoryError)
_LASTING_CODES = {
    errno.EINVAL,  # s3fs: malformed, or refused as such (HTTP 400)
    errno.EPERM,
    errno.ENOSYS,
    errno.ENAMETOOLONG,
    getattr(errno, "EREMCHG", None),  # s3fs: the bucket is in another region or elsewhere
}
_PASSING_STATUSES = {408, 425, 429}  # of the HTTP statuses 4xx: timeout, too early, too many requests

_FAILURES_OF_LIBRARIES = {
    "aiohttp": ("ClientError",),
    "botocore.exceptions": ("BotoCoreError", "ClientError"),
    "botocore.parsers": ("ResponseParserError",),
    "httpx": ("HTTPError",),
    "httpx2": ("HTTPError",),
}
_PASSING_FAILURES_OF_LIBRARIES = {
    "aiohttp": ("ClientError",),
    "botocore.exceptions": ("HTTPClientError", "ConnectionError", "IncompleteReadError", "FlexibleChecksumError"),
    "botocore.parsers": ("ResponseParserError",),
    "httpx": ("HTTPError",),
    "httpx2": ("HTTPError",),
}
"""What s3fs, fsspec's HTTP file system and the client of the Hugging Face Hub let through beside OSError: s3fs
translates the answers of a store to it, but not the failures of a connection."""


@dataclass(frozen=True, kw_only=True)
class RequestConfig:
    """How a store is asked.

    Attributes:
        attempts: how often a request is tried.
        first_backoff_s: pause after the first failed attempt, s; it doubles with each further one, up to 30 s, and each
            is shortened at random by up to one half, so that many readers do not come back at the same moment.
        timeout_s: longest time of one attempt for every 8 MiB asked for, or part of them, s. It bounds what a server
            that answers drop by drop can cost.
        connections: requests at the same time.
    """

    attempts: int = 6
    first_backoff_s: float = 0.25
    timeout_s: float = 60.0
    connections: int = 10

    def __post_init__(self) -> None:
        for name in ("attempts", "connections"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")
        if not self.first_backoff_s >= 0:
            raise ValueError(f"first_backoff_s must not be negative, found {self.first_backoff_s}")
        if not self.timeout_s > 0:
            raise ValueError(f"timeout_s must be above 0, found {self.timeout_s}")


def ask(
    request: Callable[[], Answer], name: str, config: RequestConfig, pause: Callable[[float], object] = time.sleep
) -> Answer:
    """Call `request` until it answers.

    Args:
        request: asks the store once.
        name: URL of the object, for messages.
        config: how often, and with which pauses.
        pause: waits for a number of seconds.

    Raises:
        FileNotFoundError, NotADirectoryError: the store says that there is no such object.
        StoreError: the store refuses, or failed in every attempt; names the object, the attempts and the last cause.
    """
    for attempt in range(1, config.attempts + 1):
        try:
            return request()
        except NOT_THERE:
            raise
        except _failures(_FAILURES_OF_LIBRARIES) as error:
            cause = f"{type(error).__name__}: {error}"
            if not may_pass(error):
                raise StoreError(f"{name}: the store refuses ({cause}); check the URL and the credentials") from error
            if attempt == config.attempts:
                raise StoreError(
                    f"{name}: no answer in {attempt} attempts, at last because of {cause}; check the store and the "
                    "network, then start again"
                ) from error
        pause_s = backoff_s(attempt, config)
        _LOGGER.info("%s: attempt %d of %d failed (%s)", name, attempt, config.attempts, cause)
        pause(pause_s)
    raise AssertionError("the last attempt answers or raises")


def backoff_s(attempt: int, config: RequestConfig) -> float:
    """Pause after the failed attempt of this number, counted from 1, s."""
    longest_s = min(_LONGEST_BACKOFF_S, config.first_backoff_s * 2.0 ** min(attempt - 1, 32))
    return longest_s * random.uniform(0.5, 1.0)


def may_pass(error: BaseException) -> bool:
    """Whether the same request may succeed later."""
    answer = getattr(error, "response", None)  # of httpx
    status = getattr(error, "status", None) or getattr(answer, "status_code", None)  # where a server answered
    if isinstance(status, int) and 400 <= status < 500:
        return status in _PASSING_STATUSES
    if isinstance(error, _failures(_PASSING_FAILURES_OF_LIBRARIES)):
        is_refusal = isinstance(error, (*NOT_THERE, *_LASTING))
        return not is_refusal and getattr(error, "errno", None) not in _LASTING_CODES - {None}
    return False


def _failures(names: dict[str, tuple[str, ...]]) -> tuple[type[BaseException], ...]:
    """OSError and those error types of the libraries that have been imported: what was not cannot have raised any."""
    found = [
        getattr(sys.modules[module], name) for module, types in names.items() if module in sys.modules for name in types
    ]
    return (OSError, *found)
