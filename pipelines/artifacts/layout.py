"""Where stages put what later stages read: paths inside a stage's folder, by container or trajectory."""

from pathlib import Path


def conventions_path(index: Path) -> Path:
    """The conventions that were applied to the source, written by `wsm index`."""
    return index / "conventions.json"


def records_path(index: Path, container: str) -> Path:
    """Table of the trajectories of one container, written by `wsm index`."""
    return index / "containers" / container / "records.parquet"


def surface_path(index: Path, container: str) -> Path:
    """Surface of the scene of one container, written by `wsm index`."""
    return index / "containers" / container / "surface.npz"


def map_path(maps: Path, container: str) -> Path:
    """Map of the scene of one container, written by `wsm map`."""
    return maps / "maps" / container / "map.npz"


def clips_folder(encode: Path) -> Path:
    """Folder of the clip fragments, written by `wsm encode`."""
    return encode / "clips"


def release_folder(pack: Path) -> Path:
    """The release, written by `wsm pack`."""
    return pack / "release"


def codec_path(encode: Path) -> Path:
    """What the codec of all clips says of itself, written by `wsm encode`."""
    return encode / "codec.json"
