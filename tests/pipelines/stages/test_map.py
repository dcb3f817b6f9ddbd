import shutil

import numpy as np
import pytest
from box_room import DATASET, MANIFEST_TOML, UPSTAIRS, along_x

from pipelines.artifacts.layout import map_path, surface_path
from pipelines.stages.map import WithoutCloud
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.jsonlines import read_lines
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import load_scene_map, scene_map_digest
from wsm_data.schema.occupancy import FREE, OCCUPIED

DEN, HALL, ZED = "box_d435i/den", "box_d435i/hall", "box_zed/hall"


@pytest.fixture
def indexed(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index")
    return pipeline


# units


def test_every_container_with_a_trajectory_is_a_unit(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True), DEN: ({0: along_x(frames=4)}, True)})
    (pipeline.source / "box_zed/none").mkdir()
    pipeline.run("index")
    assert list(pipeline.units("map")) == [ZED]  # of the others one has no usable trajectory, one nothing at all


def test_another_trajectory_on_a_known_floor_changes_no_input(indexed, changed):
    before = indexed.inputs("map")
    cloud = (indexed.source / HALL / "meta/pointcloud.ply").read_bytes()
    indexed.write(HALL, {3: along_x(y_m=1.0)})
    (indexed.source / HALL / "meta/pointcloud.ply").write_bytes(cloud)
    indexed.run("index")
    assert len(indexed.outcomes("index")[HALL].facts["episodes"]) == 4
    assert changed(before, indexed.inputs("map")) == {}


def test_a_trajectory_on_a_new_floor_changes_the_floors_of_its_container_alone(indexed, changed):
    before = indexed.inputs("map")
    cloud = (indexed.source / ZED / "meta/pointcloud.ply").read_bytes()
    indexed.write(ZED, {1: along_x(room=UPSTAIRS)})
    (indexed.source / ZED / "meta/pointcloud.ply").write_bytes(cloud)
    indexed.run("index")
    assert changed(before, indexed.inputs("map")) == {ZED: {"floors"}}


def test_another_trajectory_where_depth_is_fused_changes_the_surface(indexed, changed):
    before = indexed.inputs("map")
    indexed.write(DEN, {1: along_x(y_m=1.6)}, cloud=False)
    indexed.run("index")
    assert changed(before, indexed.inputs("map")) == {DEN: {"surface"}}


def test_a_damaged_cloud_is_a_changed_input(indexed, changed):
    before = indexed.inputs("map")
    (indexed.source / ZED / "meta/pointcloud.ply").write_bytes(b"no cloud")
    indexed.run("index")
    assert changed(before, indexed.inputs("map")) == {ZED: {"surface", "cloud_refusal"}}


def test_a_changed_convention_is_a_changed_input_of_every_scene(indexed, changed):
    before = indexed.inputs("map")
    indexed.set_manifest(MANIFEST_TOML + "[robot]\nground_clearance_m = 0.1\n")
    indexed.run("index")
    assert changed(before, indexed.inputs("map")) == {key: {"dataset"} for key in (DEN, HALL, ZED)}


def test_a_surface_that_changed_since_index_wrote_it_is_refused(indexed):
    path = surface_path(indexed.folder("index"), HALL)
    path.write_bytes(path.read_bytes()[::-1])
    with pytest.raises(IntegrityError, match=r"surface\.npz must hold what `wsm index` wrote, found other bytes"):
        indexed.run("map")


def test_it_starts_from_a_finished_index(make_pipeline):
    with pytest.raises(ConfigError, match="run `wsm index` first"):
        make_pipeline().run("map")


# what is written


def test_the_output_of_a_scene_is_its_map_and_the_facts_name_its_floors(finished):
    for name, outcome in finished.outcomes("map").items():
        path = map_path(finished.folder("map"), name)
        assert outcome.outputs == (str(path.relative_to(finished.folder("map"))),)
        scene_map = load_scene_map(path)
        assert outcome.digest == scene_map_digest(scene_map)
        levels = [level.floor_z_m for level in scene_map.levels]
        assert levels == {DEN: [0.0], HALL: [0.0, 3.0], ZED: [0.0]}[name]
        assert outcome.facts["floors"] == len(levels)
        assert outcome.facts["levels"] == [[z, scene_map_digest(scene_map, z)] for z in levels]
        assert outcome.facts["map_from"] == ("depth" if name == DEN else "cloud")


def test_equal_scenes_have_equal_floors_whichever_camera_saw_them_and_whatever_is_above(finished):
    levels = {name: dict(outcome.facts["levels"]) for name, outcome in finished.outcomes("map").items()}
    assert levels[HALL][0.0] == levels[ZED][0.0]


def test_the_map_of_a_cloud_shows_its_walls_its_pillar_and_its_floor(finished):
    grid = occupancy_for(load_scene_map(map_path(finished.folder("map"), ZED)), 0.0, 0.5, DATASET.robot)

    def at(x_m, y_m):
        column, row = np.floor(grid.fractional_cells(np.array([x_m, y_m])) + 0.5).astype(int)
        return grid.cells[row, column]

    assert at(1.0, 1.0) == at(3.9, 2.9) == FREE
    assert at(1.83, 1.7) == at(-0.02, 1.0) == at(4.02, 1.0) == OCCUPIED


def test_the_map_of_fused_depth_shows_the_wall_ahead_and_the_floor_in_between(finished):
    grid = occupancy_for(load_scene_map(map_path(finished.folder("map"), DEN)), 0.0, 0.5, DATASET.robot)
    y, x = np.nonzero(grid.cells == OCCUPIED)
    x_m, y_m = ((x + grid.origin_cell[0] + 0.5) * 0.05, (y + grid.origin_cell[1] + 0.5) * 0.05)
    # in a room of 4 m x 2.5 m whatever stands is a wall: cells within one of it
    to_wall_m = np.min([np.abs(x_m), np.abs(x_m - 4), np.abs(y_m), np.abs(y_m - 2.5)], axis=0)
    assert to_wall_m.max() < 0.05
    assert len(x) > 20
    free = (grid.cells == FREE).sum()
    assert free > 200


# refusals


def test_a_damaged_cloud_refuses_its_scene_with_the_readers_own_words(indexed):
    (indexed.source / ZED / "meta/pointcloud.ply").write_bytes(b"no cloud")
    indexed.run("index")
    told = indexed.outcomes("index")[ZED].facts["cloud_refusal"]
    report = indexed.run("map")
    assert (report.done, report.refused) == (2, 1)
    (line,) = read_lines(indexed.folder("map") / "quarantine.jsonl")
    assert (line["unit"], line["source"], line["reason"]) == (ZED, ZED, told["reason"])
    assert (line["message"], line["details"]) == (told["message"], told["details"])


def test_a_scene_without_a_cloud_is_fused_or_refused_as_was_asked_for(indexed):
    indexed.run("map", without_cloud=WithoutCloud.REFUSE)
    assert indexed.refusals("map") == [(DEN, "cloud.missing")]
    with pytest.raises(ConfigError, match='without_cloud: "refuse" -> "fuse"'):
        indexed.run("map")
    shutil.rmtree(indexed.folder("map"))
    indexed.run("map")
    assert indexed.refusals("map") == []


def test_a_map_wider_than_any_home_is_refused_and_the_others_go_on(indexed):
    cloud = indexed.source / ZED / "meta/pointcloud.ply"
    data = bytearray(cloud.read_bytes())
    stray = np.array([1000.0, 1000.0, 0.3], "<f4").tobytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    data[start : start + len(stray)] = stray
    cloud.write_bytes(data)
    indexed.run("index")
    report = indexed.run("map")
    assert (report.done, report.refused) == (2, 1)
    assert indexed.refusals("map") == [(ZED, "map.too_large")]
