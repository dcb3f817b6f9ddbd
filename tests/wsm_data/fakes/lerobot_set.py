"""LeRobot data sets as versions 2.1 and 3.0 lay them out, written with PyAV and pyarrow from the published format."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

RGB, DEPTH, POSE = "observation.images.rgb", "observation.images.depth", "observation.camera_pose"
FPS = 10
QUANTISATION = {"depth_min": 0.01, "depth_max": 10.0, "shift": 3.5, "use_log": True}  # LeRobot 0.6's own


@dataclass(frozen=True, kw_only=True)
class Walk:
    """An episode: uint8 [H, W, 3], float32 [H, W] in m, float64 [4, 4] a frame."""

    rgb: Sequence[np.ndarray]
    depth_m: Sequence[np.ndarray]
    T_world_camera: Sequence[np.ndarray]


def quantised(depth_m: np.ndarray) -> np.ndarray:
    """Codes of 12 bits, one after the other as LeRobot's formula has it; slow and obvious."""
    low, high = (math.log(QUANTISATION[name] + QUANTISATION["shift"]) for name in ("depth_min", "depth_max"))
    codes = [(math.log(z + QUANTISATION["shift"]) - low) / (high - low) * 4095 for z in depth_m.ravel().tolist()]
    return np.clip(np.rint(codes), 0, 4095).astype(np.uint16).reshape(depth_m.shape)


def write_set(root: Path, walks: Sequence[Walk], *, version: int, depth: bool = True) -> None:
    """Write a data set; in version 3 all episodes share one table and one video of each feature."""
    features = {
        RGB: {"dtype": "video", "shape": [*walks[0].rgb[0].shape], "info": {"video.is_depth_map": False}},
        POSE: {"dtype": "float32", "shape": [16]},
        **{name: {"dtype": "int64", "shape": [1]} for name in ("frame_index", "episode_index", "index", "task_index")},
        "timestamp": {"dtype": "float32", "shape": [1]},
    }
    if depth:
        info = {"is_depth_map": True, **{f"video.{name}": value for name, value in QUANTISATION.items()}}
        features[DEPTH] = {"dtype": "video", "shape": [*walks[0].rgb[0].shape[:2], 1], "info": info}
    writer = _write_3 if version == 3 else _write_2
    said = {"codebase_version": {2: "v2.1", 3: "v3.0"}[version], "fps": FPS, "chunks_size": 1000, "features": features}
    said |= {"total_episodes": len(walks), "total_frames": sum(len(walk.rgb) for walk in walks)}
    (root / "meta").mkdir(parents=True)
    said |= writer(root, walks, depth)
    (root / "meta" / "info.json").write_text(json.dumps(said, indent=4))


def _write_2(root: Path, walks: Sequence[Walk], depth: bool) -> dict[str, str]:
    lines = []
    for number, walk in enumerate(walks):
        data = root / "data" / "chunk-000" / f"episode_{number:06d}.parquet"
        data.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(_rows([walk], number), data)
        _video(root / "videos" / "chunk-000" / RGB / f"episode_{number:06d}.mp4", walk.rgb)
        if depth:
            codes = [quantised(one) for one in walk.depth_m]
            _depth_video(root / "videos" / "chunk-000" / DEPTH / f"episode_{number:06d}.mp4", codes)
        lines.append(json.dumps({"episode_index": number, "tasks": ["walk"], "length": len(walk.rgb)}))
    (root / "meta" / "episodes.jsonl").write_text("\n".join(lines) + "\n")
    return {
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "video_path": "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
    }


def _write_3(root: Path, walks: Sequence[Walk], depth: bool) -> dict[str, str]:
    data = root / "data" / "chunk-000" / "file-000.parquet"
    data.parent.mkdir(parents=True)
    pq.write_table(_rows(walks), data)
    _video(root / "videos" / RGB / "chunk-000" / "file-000.mp4", [one for walk in walks for one in walk.rgb])
    if depth:
        codes = [quantised(one) for walk in walks for one in walk.depth_m]
        _depth_video(root / "videos" / DEPTH / "chunk-000" / "file-000.mp4", codes)
    rows, first = [], 0
    for number, walk in enumerate(walks):
        last = first + len(walk.rgb)
        row = {"episode_index": number, "tasks": ["walk"], "length": len(walk.rgb)}
        row |= {"data/chunk_index": 0, "data/file_index": 0, "dataset_from_index": first, "dataset_to_index": last}
        for key in (RGB, DEPTH)[: 1 + depth]:
            row |= {f"videos/{key}/chunk_index": 0, f"videos/{key}/file_index": 0}
            row |= {f"videos/{key}/from_timestamp": first / FPS, f"videos/{key}/to_timestamp": last / FPS}
        rows.append(row)
        first = last
    episodes = root / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    episodes.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(rows), episodes)
    return {
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
    }


def _rows(walks: Sequence[Walk], number: int = 0) -> pa.Table:
    rows = [
        {
            POSE: np.asarray(T, np.float32).ravel().tolist(),
            "timestamp": np.float32(frame / FPS),
            "frame_index": frame,
            "episode_index": number + offset,
            "task_index": 0,
        }
        for offset, walk in enumerate(walks)
        for frame, T in enumerate(walk.T_world_camera)
    ]
    return pa.Table.from_pylist([{**row, "index": index} for index, row in enumerate(rows)])


def _video(path: Path, images: Sequence[np.ndarray]) -> None:
    frames = [av.VideoFrame.from_ndarray(image, format="rgb24") for image in images]
    _encode(path, frames, "libx264", "yuv444p", {"crf": "4", "g": "2"})


def _depth_video(path: Path, codes: Sequence[np.ndarray]) -> None:
    frames = []
    for image in codes:
        frame = av.VideoFrame(image.shape[1], image.shape[0], "gray12le")
        rows = np.zeros((image.shape[0], frame.planes[0].line_size // 2), "<u2")
        rows[:, : image.shape[1]] = image
        frame.planes[0].update(rows.tobytes())
        frames.append(frame)
    _encode(path, frames, "libx265", "gray12le", {"x265-params": "lossless=1:log-level=none", "g": "2"})


def _encode(path: Path, frames: Sequence[av.VideoFrame], codec: str, pixels: str, options: dict[str, str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS, options=options)
        stream.width, stream.height, stream.pix_fmt = frames[0].width, frames[0].height, pixels
        stream.time_base = Fraction(1, FPS)
        for number, frame in enumerate(frames):
            frame.pts, frame.time_base = number, Fraction(1, FPS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
