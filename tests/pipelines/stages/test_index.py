import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from box_room import (
    DEPTH,
    HALL,
    MANIFEST_TOML,
    RGB,
    UPSTAIRS,
    along_x,
    cloud_points,
    moved,
    ply_bytes,
    table_bytes,
)

from pipelines.artifacts.episode_table import read_episodes
from pipelines.artifacts.layout import records_path, surface_path
from pipelines.operations.dry_run import show_stage
from pipelines.running.folder import read_stage_record
from pipelines.running.options import RunOptions
from pipelines.running.settings import settings_of
from pipelines.stages import index
from pipelines.stages.index import IndexConfig, count_differences
from wsm_data.errors import ConfigError
from wsm_data.files.json_values import from_json
from wsm_data.files.jsonlines import read_lines
from wsm_data.files.typed_toml import build_config
from wsm_data.maps.voxels import load_voxels, voxels_digest
from wsm_data.readers.record_table import read_records
from wsm_data.readers.source import Container
from wsm_data.schema.source.layout import Layout

DEN, HALL_SCENE, ZED = "box_d435i/den", "box_d435i/hall", "box_zed/hall"
SHORT = along_x(frames=4)  # one frame less than a clip needs


def frame(pipeline, scene, number, kind=RGB, episode=0):
    ending = "jpg" if kind == RGB else "png"
    return pipeline.source / scene / kind / f"episode_{episode:06d}_{number:03d}.{ending}"


# units


def test_every_container_is_a_unit_and_says_which_it_is(finished):
    units = finished.units("index")
    assert list(units) == [DEN, HALL_SCENE, ZED]
    assert {unit.id: (unit.source, unit.payload.layout) for unit in units.values()} == {
        name: (name, Layout.SCENE_FOLDER) for name in units
    }


def test_a_touched_file_is_a_changed_input_of_its_container_alone(make_pipeline, changed):
    pipeline = make_pipeline()
    before = pipeline.inputs("index")
    os.utime(frame(pipeline, HALL_SCENE, 3))
    assert changed(before, pipeline.inputs("index")) == {HALL_SCENE: {"files"}}


@pytest.mark.parametrize("line", ["max_pitch_deg = 20.0", "[robot]\nradius_m = 0.3"])
def test_a_changed_convention_is_a_changed_input_of_every_container(make_pipeline, changed, line):
    pipeline = make_pipeline()
    before = pipeline.inputs("index")
    head = [one for one in MANIFEST_TOML.splitlines() if one.split(" = ")[0] != line.split(" = ")[0]]
    text = "\n".join(head)
    pipeline.set_manifest(f"{text}\n{line}\n" if line.startswith("[") else f"{line}\n{text}\n")
    assert changed(before, pipeline.inputs("index")) == {key: {"dataset"} for key in (DEN, HALL_SCENE, ZED)}


def test_where_the_source_and_its_manifest_lie_is_no_setting():
    assert settings_of(IndexConfig(source=Path("anywhere"), dataset="any.toml")) == {
        "depth_sample_every": 10,
        "same_content": "refuse",
    }


@pytest.mark.parametrize("every", [0, -1])
def test_a_sampling_that_takes_no_frame_is_refused(every):
    with pytest.raises(ConfigError, match=f"depth_sample_every must be at least 1, found {every}"):
        build_config(IndexConfig, {"source": "s", "depth_sample_every": every})


def test_a_dry_run_shows_what_the_manifest_says_its_defaults_included(make_pipeline, tmp_path, capsys):
    pipeline = make_pipeline()
    pipeline.set_manifest(f"{MANIFEST_TOML}\n[checks]\nmax_roll_deg = 12.5\n")
    config = IndexConfig(source=pipeline.source, dataset=str(pipeline.root / "rooms.toml"))
    show_stage(index.STAGE, config, tmp_path / "dry", RunOptions(dry_run=True, quiet=True))
    said = capsys.readouterr().out
    assert "index: conventions of the source" in said
    for line in ('"max_roll_deg": 12.5', '"max_pitch_up_deg": 2.0', '"reader": "interndata"'):
        assert line in said
    assert not (tmp_path / "dry").exists()


# what is written


def test_the_outputs_of_a_container_are_its_records_and_its_surface(finished):
    folder = finished.folder("index")
    for name, outcome in finished.outcomes("index").items():
        paths = [folder / output for output in outcome.outputs]
        assert paths == [records_path(folder, name), surface_path(folder, name)]
        assert all(path.is_file() for path in paths)
        assert outcome.facts["surface"] == voxels_digest(load_voxels(paths[1]))


def test_the_facts_of_a_container_are_those_of_its_trajectories(finished):
    for name, outcome in finished.outcomes("index").items():
        records = read_records(records_path(finished.folder("index"), name))
        facts = outcome.facts
        assert facts["trajectories"] == len(records) == {DEN: 1, HALL_SCENE: 3, ZED: 1}[name]
        assert facts["frames"] == sum(record.frame_count for record in records)
        assert [row["digest"] for row in facts["episodes"]] == [record.content_digest for record in records]
        assert from_json(Container, facts["container"]) == finished.units("index")[name].payload
        assert facts["bytes"] >= sum(
            path.stat().st_size for kind in (RGB, DEPTH) for path in (finished.source / name / kind).iterdir()
        )


def test_the_table_lists_every_trajectory_with_its_floor(finished):
    rows = {row.id.text: row for row in read_episodes(finished.folder("index"))}
    assert list(rows) == [f"{DEN}/000000", *(f"{HALL_SCENE}/00000{n}" for n in range(3)), f"{ZED}/000000"]
    assert [row.frames for row in rows.values()] == [7, 7, 7, 7, 6]
    # floors are stored poses less the mount, both float32: 3 m is exact to 2e-7
    np.testing.assert_allclose([row.floor_z_m for row in rows.values()], [0, 0, 0, 3, 0], atol=1e-6)
    assert rows[f"{HALL_SCENE}/000002"].container == HALL_SCENE


def test_the_surface_is_the_cloud_or_the_depth_where_there_is_none(finished):
    folder = finished.folder("index")
    cloud, depth = (load_voxels(surface_path(folder, name)) for name in (ZED, DEN))
    assert (cloud.origin, depth.origin) == ("cloud", "depth")
    points, _ = cloud_points([HALL])
    assert len(cloud.cells) == len(np.unique(np.floor(points / np.float32([0.05, 0.05, 0.01])).astype(int), axis=0))
    xy_m = (depth.cells[:, :2] + 0.5) * 0.05
    assert (xy_m > (-0.05, -0.05)).all()  # a den of 4 m x 2.5 m, seen from inside
    assert (xy_m < (4.05, 2.55)).all()


# digests


def test_a_touched_container_of_the_same_content_has_the_same_digest(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    pipeline.run("index")
    before, finished_before = pipeline.outcomes("index"), read_stage_record(pipeline.folder("index")).finished
    os.utime(frame(pipeline, ZED, 3))
    assert pipeline.run("index").ran == (ZED,)
    assert pipeline.outcomes("index")[ZED].digest == before[ZED].digest
    assert read_stage_record(pipeline.folder("index")).finished == finished_before


@pytest.mark.parametrize("what", ["image", "cloud", "pose"])
def test_a_container_of_other_content_has_another_digest(make_pipeline, what):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    pipeline.run("index")
    before = pipeline.outcomes("index")[ZED].digest
    if what == "image":
        frame(pipeline, ZED, 3).write_bytes(frame(pipeline, ZED, 4).read_bytes())
    elif what == "cloud":
        (pipeline.source / ZED / "meta/pointcloud.ply").write_bytes(ply_bytes([HALL, UPSTAIRS]))
    else:
        pipeline.write(ZED, {0: moved(along_x(), pitch_deg=11.0)})
    pipeline.run("index")
    assert pipeline.outcomes("index")[ZED].digest != before


def test_a_convention_that_stands_in_the_release_alone_reaches_the_stages_that_write_it(make_pipeline):
    """A licence changes no record; what follows must learn of it all the same."""
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    pipeline.run("index")
    before = read_stage_record(pipeline.folder("index")).finished
    pipeline.set_manifest(MANIFEST_TOML.replace("Apache-2.0", "CC0"))
    pipeline.run("index")
    assert read_stage_record(pipeline.folder("index")).finished != before


def test_where_there_is_no_cloud_the_sampling_of_frames_decides_the_surface_and_elsewhere_it_does_not(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index")
    dense = {name: outcome.facts["surface"] for name, outcome in pipeline.outcomes("index").items()}
    sparse = make_pipeline(index={"depth_sample_every": 4})
    with pytest.raises(ConfigError, match="depth_sample_every: 2 -> 4"):
        sparse.run("index")
    sparse.run("index", options={"fork": True})
    (forked,) = [path for path in sparse.run_folder.iterdir() if path.name.startswith("index-")]
    found = {line["unit"]: line["facts"]["surface"] for line in read_lines(forked / "ledger.jsonl")}
    assert {name for name in dense if dense[name] != found[name]} == {DEN}


# refusals


def test_a_refused_trajectory_leaves_the_others_of_its_container_alone(make_pipeline):
    drives = {0: along_x(), 1: SHORT, 2: along_x(y_m=0.9), 3: along_x(y_m=1.0)}
    pipeline = make_pipeline({ZED: (drives, True)})
    frame(pipeline, ZED, 2, episode=2).write_bytes(b"")
    report = pipeline.run("index")
    assert (report.done, report.refused) == (1, 0)
    assert pipeline.refusals("index") == [(f"{ZED}/000001", "episode.too_short"), (f"{ZED}/000002", "frame.empty")]
    assert [row.id.episode for row in read_episodes(pipeline.folder("index"))] == ["000000", "000003"]
    assert {line["source"] for line in read_lines(pipeline.folder("index") / "quarantine.jsonl")} == {ZED}


def test_what_a_check_measured_is_written_down(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: SHORT}, True)})
    pipeline.run("index")
    (line,) = read_lines(pipeline.folder("index") / "quarantine.jsonl")
    assert line["details"] == {"frames": 4}
    assert f"{ZED}/000000: a trajectory must have at least 5 frames, found 4" in line["message"]


def test_a_refused_trajectory_is_not_fused_into_the_map_of_the_others(make_pipeline):
    alone = make_pipeline({DEN: ({0: along_x()}, False)})
    alone.run("index")
    surface = alone.outcomes("index")[DEN].facts["surface"]
    alone.write(DEN, {0: along_x(), 1: moved(SHORT, yaw_rad=SHORT.yaw_rad + 2.0)}, cloud=False)
    alone.run("index")
    assert alone.refusals("index") == [(f"{DEN}/000001", "episode.too_short")]
    assert alone.outcomes("index")[DEN].facts["surface"] == surface


def test_a_trajectory_whose_depth_contradicts_its_poses_is_not_fused_into_the_map_of_the_others(make_pipeline):
    """It is kept in the table: its refusal is said where it is encoded, with or without a cloud."""
    alone = make_pipeline({DEN: ({0: along_x()}, False)})
    alone.run("index")
    surface = alone.outcomes("index")[DEN].facts["surface"]
    alone.write(DEN, {0: along_x(), 1: along_x(y_m=1.0)}, cloud=False)
    alone.run("index")
    assert alone.outcomes("index")[DEN].facts["surface"] != surface
    turned = along_x(y_m=1.0)
    elsewhere = moved(turned, yaw_rad=turned.yaw_rad + np.pi)
    table = alone.source / DEN / "data/chunk-000/episode_000001.parquet"
    table.write_bytes(table_bytes(elsewhere))
    alone.run("index")
    assert alone.outcomes("index")[DEN].facts["surface"] == surface
    assert alone.outcomes("index")[DEN].facts["trajectories"] == 2


def test_a_container_that_cannot_be_read_is_refused_and_the_others_go_on(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    (pipeline.source / "box_zed" / "loft.tar.gz").write_text("version https://git-lfs.github.com/spec/v1\n")
    (pipeline.source / "box_zed" / "empty").mkdir()
    report = pipeline.run("index")
    assert (report.done, report.refused) == (1, 2)
    assert pipeline.refusals("index") == [
        ("box_zed/empty", "container.no_episodes"),
        ("box_zed/loft.tar.gz", "archive.pointer_file"),
    ]
    assert [row.container for row in read_episodes(pipeline.folder("index"))] == [ZED]


def test_a_damaged_cloud_is_told_to_the_map_and_the_trajectories_are_kept(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    cloud = pipeline.source / ZED / "meta/pointcloud.ply"
    cloud.write_bytes(cloud.read_bytes()[:4000])
    pipeline.run("index")
    outcome = pipeline.outcomes("index")[ZED]
    assert outcome.facts["surface"] == ""
    assert outcome.facts["cloud_refusal"]["reason"].startswith("cloud.")
    assert outcome.outputs == (f"containers/{ZED}/records.parquet",)
    assert len(read_episodes(pipeline.folder("index"))) == 1
    assert pipeline.refusals("index") == []  # `map` refuses the scene, `encode` its trajectories


def test_a_cloud_without_obstacles_is_told_to_the_map_too(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    cloud = pipeline.source / ZED / "meta/pointcloud.ply"
    cloud.write_bytes(cloud.read_bytes().replace(bytes((0, 0, 128)), bytes((9, 9, 9))))
    pipeline.run("index")
    assert pipeline.outcomes("index")[ZED].facts["cloud_refusal"]["reason"] == "cloud.no_obstacles"
    assert pipeline.outcomes("index")[ZED].facts["cloud_refusal"]["unit"] == ZED


def test_a_depth_image_that_does_not_decode_adds_nothing_to_a_fused_map_and_does_not_stop_it(make_pipeline):
    pipeline = make_pipeline({DEN: ({0: along_x()}, False)})
    path = frame(pipeline, DEN, 2, DEPTH)
    data = path.read_bytes()
    middle = len(data) // 2
    path.write_bytes(data[:middle] + b"\0" * 20 + data[middle + 20 :])  # whole by its ends, damaged inside
    report = pipeline.run("index")
    assert (report.done, report.refused) == (1, 0)
    assert len(load_voxels(surface_path(pipeline.folder("index"), DEN)).cells) > 1000


# what only the whole can know


def test_of_a_trajectory_that_stands_twice_the_first_containers_is_kept_and_the_other_refused(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x(), 1: along_x(y_m=1.0)}, True)})
    pipeline.write(f"{ZED}.tar.gz", {1: along_x(y_m=1.0), 2: along_x(y_m=0.9)})
    pipeline.run("index")
    assert [(row.id.episode, row.container) for row in read_episodes(pipeline.folder("index"))] == [
        ("000000", ZED),
        ("000001", ZED),
        ("000002", f"{ZED}.tar.gz"),
    ]
    (line,) = read_lines(pipeline.folder("index") / "quarantine.jsonl")
    assert (line["unit"], line["source"], line["reason"]) == (f"{ZED}/000001", f"{ZED}.tar.gz", "episode.duplicate")
    assert line["details"] == {"kept_in": ZED, "same_content": True}


def test_a_second_trajectory_of_another_content_is_refused_as_such(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True), f"{ZED}.tar.gz": ({0: along_x(y_m=1.0)}, True)})
    pipeline.run("index")
    (line,) = read_lines(pipeline.folder("index") / "quarantine.jsonl")
    assert line["details"]["same_content"] is False
    assert "with other content" in line["message"]


def test_when_the_kept_one_leaves_the_other_takes_its_place(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True), f"{ZED}.tar.gz": ({0: along_x()}, True)})
    pipeline.run("index")
    shutil.rmtree(pipeline.source / ZED)
    assert pipeline.run("index").ran == ()
    assert [row.container for row in read_episodes(pipeline.folder("index"))] == [f"{ZED}.tar.gz"]
    assert pipeline.refusals("index") == []


def test_a_container_that_is_pending_is_not_in_the_table_yet(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index", options={"limit": 1})
    assert [row.container for row in read_episodes(pipeline.folder("index"))] == [DEN]
    pipeline.run("index")
    assert len(read_episodes(pipeline.folder("index"))) == 5


def test_the_same_scene_gives_the_same_records_and_surface_as_folder_and_as_archive(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    pipeline.run("index")
    as_folder = pipeline.outcomes("index")[ZED].facts
    pipeline.write(f"{ZED}.tar.gz", {0: along_x()})
    shutil.rmtree(pipeline.source / ZED)
    pipeline.run("index")
    as_archive = pipeline.outcomes("index")[f"{ZED}.tar.gz"].facts
    assert as_archive["surface"] == as_folder["surface"]
    assert as_archive["episodes"][0]["digest"] == as_folder["episodes"][0]["digest"]


def test_a_group_with_another_number_of_trajectories_than_published_is_told_and_an_absent_group_is_not():
    expected = {"gibson_zed": 13_093, "replica_zed": 637, "hm3d_zed": 7_642}
    lines = count_differences({"gibson_zed": 13_000, "replica_zed": 637, "mine": 4}, expected)
    assert len(lines) == 1
    assert lines[0].startswith("gibson_zed: 13,093 trajectories were published, 13,000 are here")
