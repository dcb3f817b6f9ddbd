"""LeRobot data sets of version 2 and 3: tables in parquet, videos in MP4; a container is an episode."""

from pathlib import Path

from wsm_data.errors import ConfigError, DataError
from wsm_data.files.digest import digest_json
from wsm_data.readers.lerobot.meta import INFO_FILE, EpisodePlace, read_info, read_places
from wsm_data.readers.lerobot.scan import iter_episode, scan_episode, video_features
from wsm_data.readers.source import Container, SourceReader
from wsm_data.readers.unreadable import error_name
from wsm_data.schema.dataset import DatasetManifest

EXPECTS = f"{INFO_FILE} of a LeRobot data set (version 2 or 3), with data/, videos/ and meta/ beside it"


def _find_containers(source: Path, dataset: DatasetManifest) -> list[Container]:
    """Every episode of the table of episodes, whether its files are there or not."""
    if not (source / INFO_FILE).is_file():
        raise ConfigError(
            f"the source of data set {dataset.name!r} must hold {INFO_FILE}, none is in {source}; name the folder of "
            "the LeRobot data set itself"
        )
    try:
        info = read_info(source)
        known = [name for name in video_features(dataset) if name in info.features]
        places = read_places(source, info, known)
    except DataError as error:
        raise ConfigError(f"the source of data set {dataset.name!r} cannot be listed: {error.message}") from error
    about = _touched(source, INFO_FILE)
    return [
        Container(
            id=f"episode_{index:06d}", layout=f"version_{info.version}", signature=_signature(source, place, about)
        )
        for index, place in sorted(places.items())
    ]


def _signature(source: Path, place: EpisodePlace, about: list[object]) -> str:
    """Digest of what the tables say of an episode, and of names, sizes and times of its files."""
    files = [place.data_file, *(file for file, _ in place.videos.values())]
    begins = sorted((name, begins_s) for name, (_, begins_s) in place.videos.items())
    return digest_json([about, place.length, begins, *(_touched(source, name) for name in files)])


def _touched(source: Path, name: str) -> list[object]:
    try:
        status = (source / name).stat()
    except OSError as error:
        return [name, error_name(error)]
    return [name, status.st_size, status.st_mtime_ns]


LEROBOT = SourceReader(
    name="lerobot", expects=EXPECTS, find_containers=_find_containers, scan=scan_episode, iter_frames=iter_episode
)
