import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from wsm_data.clips.lerobot import writer as writer_module
from wsm_data.clips.lerobot.rows import WORLD_POSE, clip_rows
from wsm_data.clips.lerobot.writer import LerobotWriter
from wsm_data.readers.lerobot.depth_codes import codes_from_depth, quantisation_of, raw_depth_table
from wsm_data.readers.lerobot.reader import LEROBOT
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.source.motion import Motion


@pytest.fixture(scope="module")
def dataset():
    """The shipped manifest with the two features that it leaves open, and every frame."""
    made = load_dataset("lerobot")
    named = replace(
        made.features, depth="observation.images.depth", intrinsics="observation.camera_intrinsics", pose=WORLD_POSE
    )
    return replace(made, features=named, motion=Motion(carried_by="hand", floor_z_m=0.0))


def test_our_own_reader_finds_the_poses_the_camera_and_the_codes_exactly(written, dataset, clip, decoded):
    info = json.loads((written / "meta" / "info.json").read_text())
    quantisation = quantisation_of(info["features"]["observation.images.depth"])
    table = raw_depth_table(quantisation, dataset.depth.metres_per_unit)
    depth_m = np.where(decoded.measured, decoded.depth_m, 0)
    wanted = table[codes_from_depth(depth_m, quantisation)]
    containers = LEROBOT.find_containers(written, dataset)
    assert [one.layout for one in containers] == ["version_3", "version_3"]
    for container in containers:
        found = LEROBOT.scan(written, container, dataset, 2)
        [record] = found.records
        assert np.array_equal(record.T_world_camera.reshape(-1, 16), clip_rows(clip)[WORLD_POSE])
        assert record.intrinsics == clip.intrinsics
        [(_, images)] = LEROBOT.iter_frames(written, container, dataset, found.records)
        assert np.array_equal(images.depth, wanted)
        assert np.abs(np.array(images.rgb, float) - decoded.rgb).mean() < 4  # of 255; colour is lossy


def test_depth_comes_back_within_half_a_code(written, decoded):
    info = json.loads((written / "meta" / "info.json").read_text())
    quantisation = quantisation_of(info["features"]["observation.images.depth"])
    back_m = raw_depth_table(quantisation, 1e-4)[codes_from_depth(decoded.depth_m, quantisation)] * 1e-4
    error_m = np.abs(back_m - decoded.depth_m)[decoded.measured]
    assert error_m.max() < 0.0015  # at 5 m: 8.5 m x log(13.5 / 3.51) / 4095 / 2 = 1.4 mm, and the unit's half


def test_what_describes_the_set_counts_it(written, clip):
    info = json.loads((written / "meta" / "info.json").read_text())
    count = clip.meta.recorded_frames
    assert (info["codebase_version"], info["total_episodes"], info["total_frames"]) == ("v3.0", 2, 2 * count)
    assert info["splits"] == {"test": "0:1", "train": "1:2"}
    episodes = pq.read_table(written / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    assert [one["clip_key"] for one in episodes] == [clip.meta.key] * 2
    assert [(one["dataset_from_index"], one["dataset_to_index"]) for one in episodes] == [
        (0, count),
        (count, 2 * count),
    ]
    rows = pq.read_table(written / "data" / "chunk-000" / "file-000.parquet")
    assert rows["index"].to_pylist() == list(range(2 * count))
    assert rows["episode_index"].to_pylist() == [0] * count + [1] * count
    statistics = json.loads((written / "meta" / "stats.json").read_text())
    assert statistics["action"]["count"] == [2 * count]
    assert np.array(statistics["observation.images.rgb"]["mean"]).shape == (3, 1, 1)


def test_full_files_are_followed_by_the_next_and_a_set_without_depth_names_none(
    clip, decoded, dataset, tmp_path, monkeypatch
):
    pytest.importorskip("av", reason="the extra lerobot is not installed")
    monkeypatch.setattr(writer_module, "_MAX_VIDEO_MB", 0)
    size = (clip.intrinsics.width, clip.intrinsics.height)
    writer = LerobotWriter(tmp_path / "set", size=size, quantisation=None)
    for _ in range(2):
        writer.add(clip, decoded)
    writer.finish({"train": 2})
    videos = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.mp4"))
    assert videos == [f"set/videos/observation.images.rgb/chunk-000/file-00{number}.mp4" for number in (0, 1)]
    bare = replace(dataset, features=replace(dataset.features, depth=""))
    for container in LEROBOT.find_containers(tmp_path / "set", bare):
        [record] = LEROBOT.scan(tmp_path / "set", container, bare, 2).records
        assert record.frame_count == clip.meta.recorded_frames
