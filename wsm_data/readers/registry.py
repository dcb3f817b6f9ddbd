"""The kinds of source by name; a new kind is one more entry."""

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.readers.array_episodes import ARRAYS
from wsm_data.readers.guard import guarded
from wsm_data.readers.interndata.reader import INTERNDATA
from wsm_data.readers.lerobot.reader import LEROBOT
from wsm_data.readers.source import SourceReader
from wsm_data.readers.tum.reader import TUM
from wsm_data.schema.dataset import DatasetManifest

READERS: tuple[SourceReader, ...] = tuple(guarded(reader) for reader in (INTERNDATA, TUM, LEROBOT, ARRAYS))
"""Each guarded against what its parsers raise."""


def source_reader(dataset: DatasetManifest) -> SourceReader:
    """The reader that a manifest names.

    Raises:
        ConfigError: there is none of that name.
    """
    for reader in READERS:
        if reader.name == dataset.reader:
            return reader
    known = [reader.name for reader in READERS]
    raise ConfigError(
        f"the manifest of {dataset.name!r} names the reader {dataset.reader!r}, which does not exist; "
        f"{did_you_mean(dataset.reader, known)}"
    )
