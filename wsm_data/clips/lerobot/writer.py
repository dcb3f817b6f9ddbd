"""A LeRobot data set of version 3, written clip by clip."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.clips.decoded import DecodedVideo
from wsm_data.clips.lerobot.meta import (
    DATA_PATH,
    DEPTH_VIDEO,
    EPISODES_PATH,
    FILES_IN_A_CHUNK,
    RGB_VIDEO,
    STATS_PATH,
    TASKS_PATH,
    VIDEO_PATH,
    features,
    row_schema,
    tasks_table,
)
from wsm_data.clips.lerobot.rows import NAMES, clip_rows
from wsm_data.clips.lerobot.statistics import RunningStatistics
from wsm_data.clips.lerobot.videos import COLOUR, DEPTH, VideoWriter
from wsm_data.files.atomic import write_text
from wsm_data.files.jsonlines import canonical_json
from wsm_data.readers.lerobot.depth_codes import DepthQuantisation, codes_from_depth
from wsm_data.readers.lerobot.meta import INFO_FILE
from wsm_data.schema.clip import Clip

FPS = 7
"""Nominal, one control step of 0.15 s to the nearest whole number, which LeRobot asks for: a release keeps no times."""

_TASK = "Go to the goal point."
_MAX_DATA_MB, _MAX_VIDEO_MB = 100, 200
_MIB = 1 << 20
_STATISTICS_EVERY = 8
"""Of pictures, one frame in so many is looked at."""


class LerobotWriter:
    """Writes the files of a data set below `root`; `meta/info.json` comes last, and without it there is no data set.

    Several episodes share a table and a video of each kind, until one of them has LeRobot's own size.

    Args:
        root: folder to write, empty.
        size: width and height of the frames, px.
        quantisation: how depth becomes codes; None where no clip has depth.
    """

    def __init__(self, root: Path, *, size: tuple[int, int], quantisation: DepthQuantisation | None):
        self._root, self._size, self._quantisation = root, size, quantisation
        self._file = 0
        self._rows: list[pa.Table] = []
        self._videos: dict[str, VideoWriter] = {}
        self._episodes: list[dict[str, object]] = []
        self._ends = [0]
        self._statistics = {name: RunningStatistics(len(names)) for name, names in NAMES.items()}
        self._statistics |= {RGB_VIDEO: RunningStatistics(3), DEPTH_VIDEO: RunningStatistics(1)}

    def add(self, clip: Clip, decoded: DecodedVideo) -> None:
        """Append a clip as an episode.

        Args:
            clip: the clip.
            decoded: what its latents decode to at all its recorded frames.
        """
        if not self._videos:
            self._open_videos()
        rows, first = clip_rows(clip), {name: video.frames for name, video in self._videos.items()}
        self._videos[RGB_VIDEO].add(decoded.rgb)
        if self._quantisation is not None:
            depth_m = np.where(decoded.measured, decoded.depth_m, np.float32(0))
            self._videos[DEPTH_VIDEO].add(codes_from_depth(one, self._quantisation) for one in depth_m)
        self._note_statistics(rows, decoded)
        self._note_episode(clip, first)
        self._rows.append(self._table(rows, clip.meta.recorded_frames))
        if self._is_full():
            self._finish_files()

    def finish(self, splits: Mapping[str, int]) -> None:
        """Write what describes the data set.

        Args:
            splits: episodes of each split, in the order in which they were added.
        """
        if self._videos:
            self._finish_files()
        _write_table(pa.Table.from_pylist(self._episodes), self._root / EPISODES_PATH)
        _write_table(tasks_table(_TASK), self._root / TASKS_PATH)
        said = features(self._size, FPS, self._quantisation)
        shapes = {name: (len(names),) for name, names in NAMES.items()} | {RGB_VIDEO: (3, 1, 1), DEPTH_VIDEO: (1, 1, 1)}
        summaries = {name: self._statistics[name].summary(shape) for name, shape in shapes.items() if name in said}
        write_text(self._root / STATS_PATH, canonical_json(summaries) + "\n")
        write_text(self._root / INFO_FILE, canonical_json(self._info(said, splits)) + "\n")

    def abandon(self) -> None:
        """Close what is open."""
        for video in self._videos.values():
            video.close()

    def _open_videos(self) -> None:
        formats = {RGB_VIDEO: COLOUR} if self._quantisation is None else {RGB_VIDEO: COLOUR, DEPTH_VIDEO: DEPTH}
        for name, video in formats.items():
            path = self._root / VIDEO_PATH.format(video_key=name, **self._place())
            self._videos[name] = VideoWriter(path, video, self._size, FPS)

    def _finish_files(self) -> None:
        for video in self._videos.values():
            video.close()
        _write_table(pa.concat_tables(self._rows), self._root / DATA_PATH.format(**self._place()))
        self._videos, self._rows, self._file = {}, [], self._file + 1

    def _place(self) -> dict[str, int]:
        return {"chunk_index": self._file // FILES_IN_A_CHUNK, "file_index": self._file % FILES_IN_A_CHUNK}

    def _is_full(self) -> bool:
        video_bytes = max(video.size_bytes for video in self._videos.values())
        return video_bytes >= _MAX_VIDEO_MB * _MIB or sum(one.nbytes for one in self._rows) >= _MAX_DATA_MB * _MIB

    def _table(self, rows: Mapping[str, np.ndarray], count: int) -> pa.Table:
        frames = np.arange(count)
        arrays = {name: pa.FixedSizeListArray.from_arrays(row.ravel(), row.shape[1]) for name, row in rows.items()}
        arrays["timestamp"] = pa.array((frames / FPS).astype(np.float32))
        numbers = {"frame_index": frames, "index": self._ends[-2] + frames}
        numbers |= {"episode_index": np.full(count, len(self._episodes) - 1), "task_index": np.zeros_like(frames)}
        arrays |= {name: pa.array(values.astype(np.int64)) for name, values in numbers.items()}
        return pa.table(arrays, schema=row_schema())

    def _note_episode(self, clip: Clip, first: Mapping[str, int]) -> None:
        start, count, place = self._ends[-1], clip.meta.recorded_frames, self._place()
        row: dict[str, object] = {"episode_index": len(self._episodes), "tasks": [_TASK], "length": count}
        row |= {f"data/{name}": number for name, number in place.items()}
        row |= {"dataset_from_index": start, "dataset_to_index": start + count}
        for key, frame in first.items():
            row |= {f"videos/{key}/{name}": number for name, number in place.items()}
            row[f"videos/{key}/from_timestamp"] = frame / FPS
            row[f"videos/{key}/to_timestamp"] = (frame + count) / FPS
        row |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        self._episodes.append({**row, "clip_key": clip.meta.key})
        self._ends.append(start + count)

    def _note_statistics(self, rows: Mapping[str, np.ndarray], decoded: DecodedVideo) -> None:
        for name, values in rows.items():
            self._statistics[name].add(values)
        some = slice(None, None, _STATISTICS_EVERY)
        self._statistics[RGB_VIDEO].add(decoded.rgb[some].reshape(-1, 3) / 255)
        self._statistics[DEPTH_VIDEO].add(decoded.depth_m[some][decoded.measured[some]][:, None])

    def _info(self, said: Mapping[str, object], splits: Mapping[str, int]) -> dict[str, object]:
        bounds = pairwise(np.cumsum([0, *splits.values()]).tolist())
        return {
            "codebase_version": "v3.0",
            "robot_type": None,
            "total_episodes": len(self._episodes),
            "total_frames": self._ends[-1],
            "total_tasks": 1,
            "chunks_size": FILES_IN_A_CHUNK,
            "data_files_size_in_mb": _MAX_DATA_MB,
            "video_files_size_in_mb": _MAX_VIDEO_MB,
            "fps": FPS,
            "splits": {name: f"{start}:{end}" for name, (start, end) in zip(splits, bounds, strict=True)},
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH,
            "features": dict(said),
        }


def _write_table(table: pa.Table, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)
