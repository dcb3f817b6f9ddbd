"""What later stages need to know of the source that `wsm index` read: where it lies and what its conventions are."""

import json
from dataclasses import dataclass
from pathlib import Path

from pipelines.artifacts.layout import conventions_path
from pipelines.running.settings import config_json
from pipelines.running.upstream import require_stage, vouched_by_record
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import digest_json
from wsm_data.files.json_values import load_json
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import SourceReader
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
        IntegrityError: the conventions are not what the stage left.
    """
    config = require_stage(index, "index").config
    path = vouched_by_record(index, str(conventions_path(index).relative_to(index)))
    dataset = load_json(DatasetManifest, path, "the conventions of the source", "run `wsm index` again")
    return IndexedSource(root=Path(config["source"]), dataset=dataset)


def write_conventions(index: Path, dataset: DatasetManifest) -> None:
    """Write down the conventions that are applied to a source."""
    write_text(conventions_path(index), json.dumps(config_json(dataset), indent=2, sort_keys=True) + "\n")


def conventions_digest(dataset: DatasetManifest) -> str:
    """Digest of what a manifest says about the data, so that a changed convention is a changed input.

    Licence, homepage and published counts change no byte of a record, a map or a clip: they are left out.
    """
    said = config_json(dataset)
    return digest_json({name: value for name, value in said.items() if name not in _ABOUT_THE_PUBLISHER})
