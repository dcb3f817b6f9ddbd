"""What a contestant is: how it stores the clips, and how it delivers them in batches."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from loader_peers.arrays import Batch

SEED = 3


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What is asked of a loader.

    Attributes:
        folder: what `write` has written.
        shuffle: in the loader's own shuffled order, or in that of the files.
        workers: worker processes of a torch DataLoader; 0: the loader's own way in one process.
        options: settings of the contestant, by name; the peers have none beside what their modules set.
    """

    folder: Path
    shuffle: bool
    workers: int
    options: dict[str, object]


class Loader(Protocol):
    """An opened loader."""

    def epoch(self) -> Iterator[Batch]:
        """Batches of the next epoch, or of the rest of the one that `restore` went back to."""

    def state(self) -> object:
        """What `restore` takes in a fresh process; None where the library has no such thing."""

    def restore(self, state: object) -> None:
        """Go back to the place where `state` was taken."""


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """One library.

    Attributes:
        write: store all clips in the library's own format in a new folder.
        open: make a loader; the time of this counts in that of the first batch.
    """

    write: Callable[[Path], None]
    open: Callable[[Setting], Loader]
