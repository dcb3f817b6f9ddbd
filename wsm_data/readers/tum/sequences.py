"""Where sequences lie: the source itself, or folders below it."""

import os
from collections.abc import Iterator
from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.readers.folder_signature import folder_signature
from wsm_data.readers.source import Container
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.source.sequence_files import SequenceFiles

BELOW, ITSELF = "sequence", "sequence_root"
"""Layouts of a container: a folder below the source, and the source itself."""

MAX_DEPTH = 3
"""Sequences lie at most so many folders below the source."""

EXPECTS = "a sequence, or folders of sequences: rgb.txt, depth.txt and groundtruth.txt (names as in the manifest)"


def find_containers(source: Path, dataset: DatasetManifest) -> list[Container]:
    """The source where it is a sequence, else every folder below it that is one, sorted by id.

    A folder with images but without poses is listed too, so that it is refused by name.

    Raises:
        ConfigError: the source is no folder, or there is no sequence in it.
    """
    if source.is_dir() and is_sequence(source, dataset.files):
        return [Container(id=source.resolve().name, layout=ITSELF, signature=folder_signature(source))]
    found = [folder for folder in _folders(source, MAX_DEPTH) if is_sequence(folder, dataset.files)]
    if not found:
        wanted = f"{dataset.files.rgb} or {dataset.files.poses}"
        raise ConfigError(
            f"the source of data set {dataset.name!r} must be a sequence or hold sequences, but neither {source} "
            f"nor a folder at most {MAX_DEPTH} below it holds {wanted}; unpack what was downloaded, or name the files "
            "in the manifest's section [files]"
        )
    return [
        Container(id=folder.relative_to(source).as_posix(), layout=BELOW, signature=folder_signature(folder))
        for folder in sorted(found)
    ]


def is_sequence(folder: Path, files: SequenceFiles) -> bool:
    """Whether a folder holds the colour images or the poses of a sequence."""
    return any(next(folder.glob(pattern), None) is not None for pattern in (files.rgb, files.poses))


def folder_of(source: Path, container: Container) -> Path:
    """Where the files of a container lie."""
    return source if container.layout == ITSELF else source / container.id


def _folders(folder: Path, depth: int) -> Iterator[Path]:
    try:
        below = sorted(Path(entry.path) for entry in os.scandir(folder) if entry.is_dir() and entry.name[0] != ".")
    except OSError:
        return
    for one in below:
        yield one
        if depth > 1:
            yield from _folders(one, depth - 1)
