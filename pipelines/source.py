"""What later stages need to know of the source that `wsm index` read: where it lies and what its conventions are."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pipelines.config import config_json
from pipelines.upstream import require_stage
from wsm_data.files.digest import digest_json
from wsm_data.readers.containers import Container, Layout
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.dataset import DatasetManifest


@dataclass(frozen=True, kw_only=True)
class IndexedSource:
    """A source tree as `wsm index` saw it.

    Attributes:
        root: root of the tree.
        dataset: its conventions.
    """

    root: Path
    dataset: DatasetManifest


def indexed_source(index: Path) -> IndexedSource:
    """The source of an index folder.

    Raises:
        ConfigError: the folder is not a finished index, or its data set manifest is gone.
    """
    config = require_stage(index, "index").config
    return IndexedSource(root=Path(config["source"]), dataset=load_dataset(config["dataset"]))


def conventions_digest(dataset: DatasetManifest) -> str:
    """Digest of everything a manifest says, so that a changed convention is a changed input."""
    return digest_json(config_json(dataset))


def container_json(container: Container) -> dict[str, Any]:
    """JSON object of a container, for the ledger of the index."""
    return {**asdict(container), "layout": container.layout.value}


def container_from_json(record: dict[str, Any]) -> Container:
    """Inverse of `container_json`."""
    return Container(**{**record, "layout": Layout(record["layout"])})
