"""A hostile input: what is planted into a source, and what must be said of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Hostile:
    """One input.

    Attributes:
        name: what it is, in words.
        plant: writes it at a path; a folder, where nothing else is said.
        refused: reason code that a line of the quarantine must have; empty where it is harmless.
        place: path of the container in the source, and its name in that line.
    """

    name: str
    plant: Callable[[Path], object]
    refused: str
    place: str
