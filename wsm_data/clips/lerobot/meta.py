"""The descriptions in `meta/` of a LeRobot data set: its features, and its tasks as pandas reads them."""

import json
from collections.abc import Mapping
from dataclasses import asdict

import pyarrow as pa

from wsm_data.clips.lerobot.rows import DTYPES, NAMES
from wsm_data.clips.lerobot.videos import COLOUR, DEPTH, VideoFormat
from wsm_data.readers.lerobot.depth_codes import DepthQuantisation

RGB_VIDEO, DEPTH_VIDEO = "observation.images.rgb", "observation.images.depth"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH, TASKS_PATH = "meta/episodes/chunk-000/file-000.parquet", "meta/tasks.parquet"
STATS_PATH = "meta/stats.json"
FILES_IN_A_CHUNK = 1000

_COUNTERS = ("frame_index", "episode_index", "index", "task_index")


def features(size: tuple[int, int], fps: int, quantisation: DepthQuantisation | None) -> dict[str, object]:
    """`features` of `meta/info.json`.

    Args:
        size: width and height of a frame, px.
        fps: frames a second.
        quantisation: how depth becomes codes; None where there is no depth.
    """
    said: dict[str, object] = {RGB_VIDEO: _video(COLOUR, size, fps, {"is_depth_map": False})}
    if quantisation is not None:
        words = {f"video.{name}": value for name, value in asdict(quantisation).items()}
        said[DEPTH_VIDEO] = _video(DEPTH, size, fps, {"is_depth_map": True, "depth_unit": "m", **words})
    for name, names in NAMES.items():
        said[name] = {"dtype": DTYPES[name], "shape": [len(names)], "names": list(names)}
    said["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    return said | {name: {"dtype": "int64", "shape": [1], "names": None} for name in _COUNTERS}


def row_schema() -> pa.Schema:
    """Columns of the tables of rows: those of `features` that are no videos."""
    numbers = [pa.field(name, pa.list_(pa.type_for_alias(DTYPES[name]), len(names))) for name, names in NAMES.items()]
    return pa.schema([*numbers, pa.field("timestamp", pa.float32()), *(pa.field(one, pa.int64()) for one in _COUNTERS)])


def tasks_table(task: str) -> pa.Table:
    """The one task, of index 0, in a table whose index pandas takes from the column `task`, as LeRobot asks."""
    table = pa.table({"task_index": pa.array([0], pa.int64()), "task": pa.array([task])})
    columns = [_pandas_column("task_index", "int64", "int64"), _pandas_column("task", "unicode", "object")]
    said = {"index_columns": ["task"], "column_indexes": [], "columns": columns, "pandas_version": "2.2.0"}
    return table.replace_schema_metadata({"pandas": json.dumps(said)})


def _pandas_column(name: str, pandas_type: str, numpy_type: str) -> dict[str, object]:
    types = {"pandas_type": pandas_type, "numpy_type": numpy_type}
    return {"name": name, "field_name": name, **types, "metadata": None}


def _video(video: VideoFormat, size: tuple[int, int], fps: int, more: Mapping[str, object]) -> dict[str, object]:
    width, height = size
    words: dict[str, object] = {"height": height, "width": width, "channels": video.channels, "fps": fps}
    words |= {"codec": video.codec, "pix_fmt": video.pixels}
    info = {**{f"video.{name}": value for name, value in words.items()}, "has_audio": False, **more}
    names = ["height", "width", "channels"]
    return {"dtype": "video", "shape": [height, width, video.channels], "names": names, "info": info}
