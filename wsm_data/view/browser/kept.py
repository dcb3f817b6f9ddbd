"""A few things that took time to make, kept while they are looked at."""

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from typing import Generic, TypeVar

KeyT = TypeVar("KeyT")
ValueT = TypeVar("ValueT")


class Kept(Generic[KeyT, ValueT]):
    """What `make` makes of a key; the last `count` that were asked for are kept, and one is made at a time."""

    def __init__(self, make: Callable[[KeyT], ValueT], count: int) -> None:
        self._make, self._count = make, count
        self._values: OrderedDict[KeyT, ValueT] = OrderedDict()
        self._lock = Lock()

    def get(self, key: KeyT) -> ValueT:
        """The value of a key, made where it is not at hand; what `make` raises is raised."""
        with self._lock:
            if key not in self._values:
                self._values[key] = self._make(key)
                if len(self._values) > self._count:
                    self._values.popitem(last=False)
            self._values.move_to_end(key)
            return self._values[key]
