import hashlib
import io
import tarfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import ConfigError
from wsm_data.synth.writers import recording
from wsm_data.synth.writers.scenes import write_scene

RGB, DEPTH = "videos/chunk-000/observation.images.rgb", "videos/chunk-000/observation.images.depth"


@pytest.fixture(scope="module")
def trees(tmp_path_factory, small, home):
    """The same scene in every layout: root and written paths."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "make_home", lambda seed, scene, _clearance_m: {(0, 0): home}[seed, scene])
        for layout in ("scene_archive", "scene_folder", "trajectory_folder"):
            root = tmp_path_factory.mktemp(layout)
            found[layout] = root, write_scene(root, 0, "d435i", replace(small, layout=layout))
    return found


def folder_files(root: Path) -> dict[str, bytes]:
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def test_paths_are_those_of_the_layouts(trees):
    assert trees["scene_archive"][1] == ["synth_d435i/home_0001.tar.gz"]
    assert trees["scene_folder"][1] == ["synth_d435i/home_0001"]
    assert trees["trajectory_folder"][1] == [f"synth_d435i/home_0001/trajectory_0{i}" for i in range(2)]


def test_an_archive_holds_exactly_the_scene_folder(trees):
    (root, (name,)), (folder, _) = trees["scene_archive"], trees["scene_folder"]
    with tarfile.open(root / name) as archive:
        packed = {info.name: archive.extractfile(info).read() for info in archive}
    assert packed == folder_files(folder / "synth_d435i")


def test_frames_are_the_same_bytes_in_every_layout(trees):
    scene = folder_files(trees["scene_folder"][0] / "synth_d435i/home_0001")
    lone = folder_files(trees["trajectory_folder"][0] / "synth_d435i/home_0001")
    for episode in range(2):
        frames = sorted(name for name in scene if name.startswith(f"{RGB}/episode_{episode:06d}"))
        assert len(frames) >= 8
        assert len([name for name in lone if name.startswith(f"trajectory_{episode:02d}/{RGB}")]) == len(frames)
        for number in range(len(frames)):
            stem, there = f"episode_{episode:06d}_{number:03d}", f"trajectory_{episode:02d}"
            assert scene[f"{RGB}/{stem}.jpg"] == lone[f"{there}/{RGB}/{number}.jpg"]
            assert scene[f"{DEPTH}/{stem}.png"] == lone[f"{there}/{DEPTH}/{number}.png"]


def test_tables_differ_only_in_their_frame_numbers(trees):
    scene = folder_files(trees["scene_folder"][0] / "synth_d435i/home_0001")
    lone = folder_files(trees["trajectory_folder"][0] / "synth_d435i/home_0001")
    for episode in range(2):
        ours = pq.read_table(io.BytesIO(scene[f"data/chunk-000/episode_{episode:06d}.parquet"]))
        theirs = pq.read_table(io.BytesIO(lone[f"trajectory_{episode:02d}/data/chunk-000/episode_000000.parquet"]))
        assert ours.drop_columns("index").equals(theirs.drop_columns("index"))
        assert theirs["index"].to_pylist() == list(range(len(theirs)))
    assert np.diff(ours["index"].to_numpy()).tolist() == [1] * (len(ours) - 1)


def test_trajectory_clouds_are_the_scene_s_with_the_path_behind(trees):
    scene = folder_files(trees["scene_folder"][0] / "synth_d435i/home_0001")["meta/pointcloud.ply"]
    lone = folder_files(trees["trajectory_folder"][0] / "synth_d435i/home_0001")[
        "trajectory_01/data/chunk-000/path.ply"
    ]
    scene_points, lone_points = (data.split(b"end_header\n", 1)[1] for data in (scene, lone))
    assert lone_points.startswith(scene_points)
    path = lone_points[len(scene_points) :]
    assert len(path) % 15 == 0
    assert all(path[i + 12 : i + 15] == bytes(3) for i in range(0, len(path), 15))


def test_a_scene_built_anew_has_the_same_bytes(trees, small, tmp_path):
    root, (name,) = trees["scene_archive"]
    recording._scene.cache_clear()
    write_scene(tmp_path / "again", 0, "d435i", small)
    assert hashlib.sha256((tmp_path / "again" / name).read_bytes()).digest() == (
        hashlib.sha256((root / name).read_bytes()).digest()
    )


def test_flat_matrices_change_nothing_but_the_tables(trees, small, known_home, tmp_path):
    write_scene(tmp_path / "flat", 0, "d435i", replace(small, matrices="flat", layout="scene_folder"))
    flat, nested = (
        folder_files(base / "synth_d435i/home_0001") for base in (tmp_path / "flat", trees["scene_folder"][0])
    )
    assert {k for k in nested if nested[k] != flat[k]} == {f"data/chunk-000/episode_00000{i}.parquet" for i in range(2)}


def test_a_failed_scene_leaves_nothing_behind(known_home, tmp_path, small):
    endless = replace(small, min_frames=900, max_frames=999, min_step_m=0.9, max_step_m=1.0)
    with pytest.raises(ConfigError):
        write_scene(tmp_path, 0, "d435i", endless)
    assert list(tmp_path.rglob("*")) == []
