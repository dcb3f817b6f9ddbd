"""Where the time of a loader goes: seconds by part, added up by all of its threads."""

import threading
import time
from collections.abc import Iterable, Mapping
from enum import StrEnum


class Part(StrEnum):
    """What a loader spends time on."""

    STORE = "store"  # reading bytes, from a disk or a store
    CHECKSUM = "checksum"  # comparing checksums and headers
    COLLATE = "collate"  # all else that makes a batch of them: standardising, padding, masks
    TRANSFER = "transfer"  # copying to a device
    WAIT = "wait"  # what the training loop waited for batches


class Timing:
    """Adds up seconds by part. Threads work at the same time, so the parts may add up to more than passed."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seconds = dict.fromkeys(Part, 0.0)

    def add(self, seconds: Mapping[Part, float]) -> None:
        """Add what was measured."""
        with self._lock:
            for part, value in seconds.items():
                self._seconds[part] += value

    def seconds(self) -> dict[Part, float]:
        """What has been added up so far."""
        with self._lock:
            return dict(self._seconds)


class Stopwatch:
    """Measures the parts of some work, in one thread."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(Part, 0.0)

    def measure(self, part: Part) -> "_Measured":
        """Count the time until the end of a `with` block, errors included, to a part."""
        return _Measured(self.seconds, part)


class _Measured:
    """A block of a stopwatch. Not a generator: it is entered for every clip, and is three times as fast."""

    __slots__ = ("_part", "_seconds", "_start")

    def __init__(self, seconds: dict[Part, float], part: Part):
        self._seconds, self._part = seconds, part

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_error: object) -> None:
        self._seconds[self._part] += time.perf_counter() - self._start


def total_seconds(watches: Iterable[Stopwatch]) -> dict[Part, float]:
    """Seconds of several threads, added up by part."""
    total = dict.fromkeys(Part, 0.0)
    for watch in watches:
        for part, seconds in watch.seconds.items():
            total[part] += seconds
    return total
