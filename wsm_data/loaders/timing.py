"""Where the time of a loader goes: seconds by part, added up over all of its threads."""

import threading
import time
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

    def measure(self, part: Part) -> "_Measured":
        """Count the time until the end of a `with` block, errors included, to a part."""
        return _Measured(self, part)

    def add(self, part: Part, seconds: float) -> None:
        """Add what was measured."""
        with self._lock:
            self._seconds[part] += seconds

    def seconds(self) -> dict[Part, float]:
        """What has been added up so far."""
        with self._lock:
            return dict(self._seconds)


class _Measured:
    """A block that is measured. Not a generator: it is entered for every clip, and is three times as fast."""

    __slots__ = ("_part", "_start", "_timing")

    def __init__(self, timing: Timing, part: Part):
        self._timing, self._part = timing, part

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *_error: object) -> None:
        self._timing.add(self._part, time.perf_counter() - self._start)
