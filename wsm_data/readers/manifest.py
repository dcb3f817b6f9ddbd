"""The conventions of a source, from its TOML file: a wrong word is an error, never a default."""

from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean, load_config
from wsm_data.schema.dataset import DatasetManifest

MANIFEST_FOLDER = Path(__file__).resolve().parents[2] / "manifests" / "datasets"
"""Where the shipped manifests lie: beside the packages, in a checkout as in an installed wheel."""


def load_dataset(name_or_path: str | Path) -> DatasetManifest:
    """Read the manifest of a data set.

    Args:
        name_or_path: the name of a shipped manifest, such as `interndata_n1`, or the path of a TOML file: a `Path`, or
            text with a `/` or the ending `.toml`.

    Raises:
        ConfigError: no such manifest, not TOML, or a key, type or value that does not belong there.
    """
    return load_config(DatasetManifest, _manifest_path(name_or_path))


def _manifest_path(name_or_path: str | Path) -> Path:
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or text.endswith(".toml"):
        return Path(text)
    known = sorted(path.stem for path in MANIFEST_FOLDER.glob("*.toml"))
    if text not in known:
        raise ConfigError(f"there is no data set {text!r}; {did_you_mean(text, known)}")
    return MANIFEST_FOLDER / f"{text}.toml"
