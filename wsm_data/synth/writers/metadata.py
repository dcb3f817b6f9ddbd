"""The meta files of a data set in the LeRobot v2.1 manner, with what InternData-N1 adds to them."""

import json
from collections.abc import Mapping, Sequence

from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.camera import Intrinsics

TASK = "Drive to the goal without touching anything."
_FPS = 30  # what InternData-N1 states; the true rate of its frames is not known


def meta_files(lengths: Sequence[int], intrinsics: Intrinsics) -> dict[str, bytes]:
    """`info.json`, `episodes.jsonl`, `episodes_stats.jsonl` and `tasks.jsonl` of episodes with these lengths."""
    starts = [sum(lengths[:i]) for i in range(len(lengths))]
    episodes: list[Mapping[str, object]] = [
        {"episode_index": i, "tasks": [TASK], "length": length} for i, length in enumerate(lengths)
    ]
    stats: list[Mapping[str, object]] = [_statistics(i, start, lengths[i]) for i, start in enumerate(starts)]
    return {
        "meta/info.json": (json.dumps(_info(lengths, intrinsics), indent=4) + "\n").encode(),
        "meta/episodes.jsonl": _lines(episodes),
        "meta/episodes_stats.jsonl": _lines(stats),
        "meta/tasks.jsonl": _lines([{"task_index": 0, "task": TASK}]),
    }


def _lines(records: Sequence[Mapping[str, object]]) -> bytes:
    return b"".join(canonical_json(record).encode() + b"\n" for record in records)


def _statistics(episode: int, start: int, length: int) -> dict[str, object]:
    """`image_index` are the episode's first and last place in the sorted listing of the scene's images."""
    last = start + length - 1
    mean = (start + last) / 2
    deviation = ((length * length - 1) / 12) ** 0.5
    index = {"min": [start], "max": [last], "mean": [mean], "std": [deviation], "count": [length]}
    return {"episode_index": episode, "image_index": {"min": start, "max": last}, "stats": {"index": index}}


def _info(lengths: Sequence[int], intrinsics: Intrinsics) -> dict[str, object]:
    image = {
        "dtype": "image",
        "shape": [intrinsics.height, intrinsics.width, 3],
        "names": ["height", "width", "channel"],
    }
    depth = {**image, "dtype": "image", "shape": [intrinsics.height, intrinsics.width, 1]}
    return {
        "codebase_version": "v2.1",
        "robot_type": "cylinder",
        "total_episodes": len(lengths),
        "total_frames": sum(lengths),
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": 1,
        "chunks_size": 1000,
        "fps": _FPS,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "features": {
            "observation.images.rgb": image,
            "observation.images.depth": depth,
            "observation.camera_intrinsic": {"dtype": "float32", "shape": [3, 3]},
            "observation.camera_extrinsic": {"dtype": "float32", "shape": [4, 4]},
            "action": {"dtype": "float32", "shape": [4, 4]},
            "index": {"dtype": "int64", "shape": [1]},
        },
    }
