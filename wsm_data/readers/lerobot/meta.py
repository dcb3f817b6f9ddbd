"""What a LeRobot data set says of itself: version, rate, features, and in which files each episode lies."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import pyarrow.parquet as pq

from wsm_data.errors import DataError, Reason
from wsm_data.readers.unreadable import open_file, read_file

INFO_FILE = "meta/info.json"
V2_EPISODES_FILE = "meta/episodes.jsonl"
V3_EPISODES = "meta/episodes/chunk-*/file-*.parquet"

_FIELD = re.compile(r"\{(\w+)(?::0(\d)d)?\}")


@dataclass(frozen=True, kw_only=True)
class DatasetInfo:
    """What `meta/info.json` says.

    Attributes:
        version: major version of the layout, 2 or 3.
        fps: frames a second.
        features: what is said of each feature, by name.
        data_path: template of the table of an episode.
        video_path: template of a video of it; empty where there are none.
    """

    version: int
    fps: float
    features: Mapping[str, Mapping[str, Any]]
    data_path: str
    video_path: str


@dataclass(frozen=True, kw_only=True)
class EpisodePlace:
    """Where an episode lies.

    Attributes:
        index: of the episode.
        length: its frames; None where that is not written down.
        data_file: its table, relative to the root; in version 3 others share it.
        videos: by feature, its file and the time at which the episode begins in it, s.
    """

    index: int
    length: int | None
    data_file: str
    videos: Mapping[str, tuple[str, float]]


def read_info(root: Path) -> DatasetInfo:
    """Read `meta/info.json`.

    Raises:
        DataError: `file.unreadable`, or `sequence.unreadable` where it is not that of version 2 or 3.
    """
    try:
        said = json.loads(read_file(f"{root}/{INFO_FILE}", INFO_FILE))
        version = int(str(said["codebase_version"]).lstrip("v").split(".")[0])
        if version not in (2, 3):
            raise ValueError(f"codebase_version must be 2 or 3, found {said['codebase_version']!r}")
        features = {str(name): dict(feature) for name, feature in dict(said["features"]).items()}
        fps, data_path, video_path = float(said["fps"]), str(said["data_path"]), str(said.get("video_path") or "")
        if not 0 < fps < float("inf"):
            raise ValueError(f"fps must be positive, found {fps}")
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise unreadable(f"{INFO_FILE} must describe a LeRobot data set, but {error!r}") from error
    return DatasetInfo(version=version, fps=fps, features=features, data_path=data_path, video_path=video_path)


def read_places(root: Path, info: DatasetInfo, videos: Sequence[str]) -> dict[int, EpisodePlace]:
    """Where every episode lies, by its index.

    Args:
        root: of the data set.
        info: of it.
        videos: features whose videos are wanted.

    Raises:
        DataError: `file.unreadable`, or `sequence.unreadable` where the table of episodes is none.
    """
    try:
        if info.version == 2:
            return _version_2(root, info, videos)
        return _version_3(root, info, videos)
    except (ValueError, KeyError, TypeError, RecursionError) as error:  # Arrow's errors about a file among them
        raise unreadable(f"the table of episodes must be that of version {info.version}, but {error!r}") from error


def _version_2(root: Path, info: DatasetInfo, videos: Sequence[str]) -> dict[int, EpisodePlace]:
    lengths: dict[int, int] = {}
    for line in read_file(f"{root}/{V2_EPISODES_FILE}", V2_EPISODES_FILE).decode().splitlines():
        if line.strip():
            said = json.loads(line)
            lengths[int(said["episode_index"])] = int(said["length"])
    chunk = _chunks_size(root)
    places = {}
    for index, length in sorted(lengths.items()):
        words: dict[str, int | str] = {"episode_index": index, "episode_chunk": index // chunk}
        paths = {key: (_path(info.video_path, {**words, "video_key": key}), 0.0) for key in videos}
        places[index] = EpisodePlace(index=index, length=length, data_file=_path(info.data_path, words), videos=paths)
    return places


def _chunks_size(root: Path) -> int:
    size = int(json.loads(read_file(f"{root}/{INFO_FILE}", INFO_FILE)).get("chunks_size", 1000))
    if size < 1:
        raise ValueError(f"chunks_size must be at least 1, found {size}")
    return size


def _version_3(root: Path, info: DatasetInfo, videos: Sequence[str]) -> dict[int, EpisodePlace]:
    columns = ["episode_index", "length", "data/chunk_index", "data/file_index"]
    columns += [f"videos/{key}/{what}" for key in videos for what in ("chunk_index", "file_index", "from_timestamp")]
    places: dict[int, EpisodePlace] = {}
    for path in sorted(root.glob(V3_EPISODES)):
        with open_file(path, str(path.relative_to(root))) as file:
            table = pq.read_table(file, columns=columns)
        if missing := sorted(set(columns) - set(table.column_names)):
            raise ValueError(f"{path.name} must have the columns {', '.join(missing)}")
        for row in table.to_pylist():
            place = _place(row, info, videos)
            places[place.index] = place
    return places


def _place(row: Mapping[str, Any], info: DatasetInfo, videos: Sequence[str]) -> EpisodePlace:
    def indices(prefix: str) -> dict[str, int | str]:
        return {name: int(row[f"{prefix}/{name}"]) for name in ("chunk_index", "file_index")}

    paths = {
        key: (
            _path(info.video_path, {**indices(f"videos/{key}"), "video_key": key}),
            float(row[f"videos/{key}/from_timestamp"]),
        )
        for key in videos
    }
    return EpisodePlace(
        index=int(row["episode_index"]),
        length=int(row["length"]),
        data_file=_path(info.data_path, indices("data")),
        videos=paths,
    )


def _path(template: str, words: Mapping[str, int | str]) -> str:
    """Fill in a template such as `data/chunk-{chunk_index:03d}/...`; it must stay within the data set."""

    def word(found: re.Match[str]) -> str:
        value = words[found[1]]
        return f"{value:0{found[2] or 1}d}" if isinstance(value, int) else value

    text = _FIELD.sub(word, template)
    path = PurePosixPath(text)
    if not text or path.is_absolute() or ".." in path.parts or "{" in text:
        raise ValueError(f"a template of paths must lead into the data set, found {template!r}")
    return text


def unreadable(message: str) -> DataError:
    """Refusal of a file of the data set."""
    return DataError(Reason.SEQUENCE_UNREADABLE, f"{message}; fetch it again, or export it with LeRobot")
