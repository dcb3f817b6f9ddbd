"""Which manifest a folder could be read with, where none was named."""

from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import READERS, source_reader
from wsm_data.schema.dataset import DatasetManifest

GUESSES = (
    ("arrays", "lerobot", "tum_rgbd", "bonn_rgbd", "replica_sequences", "scannet_sequences", "icl_nuim"),
    ("interndata_n1", "synthetic"),
)
"""Manifests that are tried; the last ones only where no other fits, for any two folders could be InternData's."""


def fitting_manifests(source: Path) -> list[str]:
    """Names of the shipped manifests whose layout fits a source, the likeliest first.

    Raises:
        ConfigError: none does.
    """
    guesses = ([name for name in names if _fits(source, load_dataset(name))] for names in GUESSES)
    fits = next(filter(None, guesses), None)
    if fits is None:
        raise ConfigError(f"{source} must be a source, and none fits; what was looked for:\n{layouts()}")
    return fits


def layouts() -> str:
    """What a source of every reader looks like, a line each."""
    return "\n".join(f"  {reader.name}: {reader.expects}" for reader in READERS)


def _fits(source: Path, dataset: DatasetManifest) -> bool:
    try:
        return bool(source_reader(dataset).find_containers(source, dataset))
    except ConfigError:
        return False
