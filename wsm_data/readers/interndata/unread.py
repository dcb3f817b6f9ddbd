"""Files that are there under names that are not read, for the messages about what was not found."""

from dataclasses import dataclass, field
from pathlib import PurePosixPath

from wsm_data.readers.interndata.naming import Kind

_PICTURES = frozenset((".jpg", ".jpeg", ".png", ".webp", ".bmp", ".tif", ".tiff", ".exr", ".pgm", ".ppm", ".npy"))
_TABLES = frozenset((".parquet", ".csv", ".feather", ".arrow", ".jsonl"))
_FORMS = {
    Kind.RGB: "videos/chunk-000/observation.images.rgb/episode_000000_0.jpg, or 0.jpg there,",
    Kind.DEPTH: "videos/chunk-000/observation.images.depth/episode_000000_0.png, or 0.png there,",
    Kind.TABLE: "data/chunk-000/episode_000000.parquet",
}


@dataclass
class Unread:
    """How many files of a container are not read, and the first name among them, by what they look like.

    Attributes:
        counts: number of names; of all files under None.
        first: the first of these names in sorted order.
    """

    counts: dict[Kind | None, int] = field(default_factory=dict)
    first: dict[Kind | None, str] = field(default_factory=dict)

    def note(self, name: str) -> None:
        """Count a name."""
        for kind in {None, _likeness(name)}:
            self.counts[kind] = self.counts.get(kind, 0) + 1
            self.first[kind] = min(name, self.first.get(kind, name))

    def advice(self, kind: Kind) -> str:
        """What to do where files of a kind are missing: rename those that seem to be them, or fetch the scene."""
        if kind not in self.counts:
            return "fetch the scene again"
        others = f"{self.counts[kind]} other files are there, such as {self.first[kind]!r}"
        return f"{others}; names like {_FORMS[kind]} are read: rename or convert them"

    def summary(self) -> str:
        """What is in a container of which nothing was read."""
        if None not in self.counts:
            return "no file at all"
        name = self.first[None]
        separator = ", with backslashes for `/`: pack it anew with `tar -czf`" if "\\" in name else ""
        return f"{self.counts[None]} files under other names, such as {name!r}{separator}"


def _likeness(name: str) -> Kind | None:
    path = PurePosixPath(name.lower().replace("\\", "/"))
    if path.suffix in _PICTURES:
        return Kind.DEPTH if "depth" in str(path) else Kind.RGB
    return Kind.TABLE if path.suffix in _TABLES and path.parts[0] != "meta" else None
