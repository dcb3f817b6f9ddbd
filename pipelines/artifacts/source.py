"""What later stages need to know of the source that `wsm index` read: where it lies and what its conventions are."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pipelines.artifacts.layout import conventions_path
from pipelines.running.settings import config_json
from pipelines.running.upstream import require_stage
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import digest_json
from wsm_data.files.typed_toml import build_config
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container, SourceReader
from wsm_data.schema.dataset import DatasetManifest

_ABOUT_THE_PUBLISHER = ("licence", "homepage", "expected_episodes")


@dataclass(frozen=True, kw_only=True)
class IndexedSource:
    """A source tree as `wsm index` saw it.

    Attributes:
        root: root of the tree.
        dataset: its conventions.
    """

    root: Path
    dataset: DatasetManifest

    @property
    def reader(self) -> SourceReader:
        """What reads it."""
        return source_reader(self.dataset)


def indexed_source(index: Path) -> IndexedSource:
    """The source of an index folder, with the conventions that were applied to it.

    Its manifest is not read again: it may have been changed since, and then says what the next `wsm index` will do.

    Raises:
        ConfigError: the folder is not a finished index.
        IntegrityError: the conventions are gone although the stage says that it is done, or cannot be read.
    """
    config = require_stage(index, "index").config
    return IndexedSource(root=Path(config["source"]), dataset=_read_conventions(conventions_path(index)))


def write_conventions(index: Path, dataset: DatasetManifest) -> None:
    """Write down the conventions that are applied to a source."""
    write_text(conventions_path(index), json.dumps(config_json(dataset), indent=2, sort_keys=True) + "\n")


def _read_conventions(path: Path) -> DatasetManifest:
    try:
        return build_config(DatasetManifest, json.loads(path.read_text()))
    except (OSError, ValueError, ConfigError) as error:
        raise IntegrityError(
            f"{path} must hold the conventions of the source ({error}); run `wsm index` again"
        ) from error


def conventions_digest(dataset: DatasetManifest) -> str:
    """Digest of what a manifest says about the data, so that a changed convention is a changed input.

    Licence, homepage and published counts change no byte of a record, a map or a clip: they are left out.
    """
    said = config_json(dataset)
    return digest_json({name: value for name, value in said.items() if name not in _ABOUT_THE_PUBLISHER})


def container_json(container: Container) -> dict[str, Any]:
    """JSON object of a container, for the ledger of the index."""
    return asdict(container)


def container_from_json(record: dict[str, Any]) -> Container:
    """Inverse of `container_json`."""
    return Container(id=record["id"], layout=record["layout"], signature=record["signature"])
