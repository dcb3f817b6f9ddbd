"""A trajectory on the map of an analytic room."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, HALL, UPSTAIRS, Drive, Room, along_x, cloud_points, moved, record_of

from wsm_data.clips.config import ClipConfig
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_view import view_scene
from wsm_data.errors import DataError, Reason
from wsm_data.maps.crop import crop_around, free_swept_cells
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import MAX_MAP_CELLS, build_scene_map, floor_levels
from wsm_data.maps.voxels import voxels_from_cloud
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.source.check_limits import CheckLimits

CELL_M = 0.05
CONFIG = ClipConfig()
NARROW = replace(CONFIG, map_margin_m=1.0)
DIVIDED = Room(high=(6.0, 5.0, 2.5), boxes=(((2.9, 0.0, 0.0), (3.1, 4.0, 2.5)),))
"""Two rooms side by side, and a passage between them at y = 4 to 5 m."""


def scene_map(rooms, drives, keep=lambda xyz: np.ones(len(xyz), bool), extra=()):
    """The map of a cloud, of which `keep` takes some points, with obstacle points added."""
    xyz, obstacle = cloud_points(rooms)
    kept = keep(xyz)
    xyz = np.concatenate([xyz[kept], np.array(extra, np.float32).reshape(-1, 3)])
    obstacle = np.concatenate([obstacle[kept], np.ones(len(extra), bool)])
    rgb = np.where(obstacle[:, None], (0, 0, 128), (200, 200, 200)).astype(np.uint8)
    voxels = voxels_from_cloud(PointCloud(xyz_m=xyz, rgb_u8=rgb), DATASET.cloud)
    floors = floor_levels([record_of(drive).floor_z_m for drive in drives])
    return build_scene_map(voxels, floors, DATASET.robot, DATASET.max_camera_height_m)


UNSEEN = replace(DATASET, checks=CheckLimits(max_unknown_path_share=1.0))
"""A source whose clouds need not show the floor under the path."""


def look(drive, scene, config=CONFIG, dataset=DATASET):
    record = record_of(drive)
    return view_scene(record, lay_path(record, scene, dataset, config), dataset, config)


def refusal(drive, scene, config=CONFIG):
    with pytest.raises(DataError) as caught:
        look(drive, scene, config)
    assert record_of(drive).id.text in caught.value.message
    return caught.value


def cell_of(view, x_m, y_m):
    """(row, column) of a position on the crop."""
    origin = view.occupancy.origin_cell
    return int(np.floor(y_m / CELL_M)) - origin[1], int(np.floor(x_m / CELL_M)) - origin[0]


def around_the_wall_m(left_m, right_m, radius_m):
    """Length of the taut way around the end of the wall of DIVIDED, m: two tangents, two arcs, and the wall's end.

    The disc keeps its radius from the centres of the outermost cells of the wall.
    """
    length = 0.15
    for dx, dy in ((2.925 - left_m[0], 3.975 - left_m[1]), (right_m[0] - 3.075, 3.975 - right_m[1])):
        away = np.hypot(dx, dy)
        length += np.sqrt(away**2 - radius_m**2) + radius_m * (np.arctan2(dy, dx) + np.arcsin(radius_m / away))
    return length


# distances


def test_on_a_free_floor_the_distance_is_the_straight_one_less_the_goal_region():
    drive = along_x()
    view = look(drive, scene_map([HALL], [drive]))
    straight_m = np.linalg.norm(drive.xy_m - drive.xy_m[-1], axis=1)
    # sampled between cell centres 0.05 m apart: a cone is bent by at most h^2 / (4 r) < 3 mm at r > 0.25 m
    np.testing.assert_allclose(view.distance_m, np.maximum(straight_m - CONFIG.goal_radius_m, 0), atol=3e-3)
    assert view.distance_m[-1] == 0


def test_a_way_that_leads_out_of_the_crop_counts_in_the_crop():
    drive = Drive(room=DIVIDED, xy_m=np.linspace((1.0, 1.0), (2.4, 1.0), 6), yaw_rad=np.zeros(6))
    view = look(drive, scene_map([DIVIDED], [drive]), NARROW)
    rows, _ = view.occupancy.cells.shape
    assert rows * CELL_M < 2.2  # the passage at y = 4 m is not on the crop
    beyond = view.geodesic_m[cell_of(view, 3.375, 1.025)]
    shortest_m, longest_m = (around_the_wall_m(drive.xy_m[-1], (3.375, 1.025), radius) for radius in (0.25, 0.3))
    assert shortest_m <= beyond + CONFIG.goal_radius_m <= longest_m  # on cells the disc keeps off up to a cell more


def test_the_crop_is_cut_out_of_the_field_of_the_whole_floor():
    drive = Drive(room=DIVIDED, xy_m=np.linspace((1.0, 1.0), (2.4, 1.0), 6), yaw_rad=np.zeros(6))
    scene, record = scene_map([DIVIDED], [drive]), record_of(drive)
    view = look(drive, scene, NARROW)
    whole = occupancy_for(scene, record.floor_z_m, record.camera_height_m, DATASET.robot)
    field_m = geodesic_distance(whole, drive.xy_m[-1], DATASET.robot.radius_m, CONFIG.goal_radius_m)
    crop, column, row = view.occupancy, *(
        inner - outer for inner, outer in zip(view.occupancy.origin_cell, whole.origin_cell, strict=True)
    )  # fmt: skip
    rows, columns = crop.cells.shape
    np.testing.assert_array_equal(crop.cells, whole.cells[row : row + rows, column : column + columns])
    np.testing.assert_array_equal(view.geodesic_m, field_m[row : row + rows, column : column + columns])
    alone = geodesic_distance(crop, drive.xy_m[-1], DATASET.robot.radius_m, CONFIG.goal_radius_m)
    assert np.isinf(alone[cell_of(view, 3.375, 1.025)])  # what a field of the crop alone would say


@pytest.mark.parametrize("margin_m", [0.0, 0.4, 2.0, 7.0])
def test_the_crop_reaches_the_margin_beyond_the_path_on_every_side_and_unknown_where_there_is_no_map(margin_m):
    drive = along_x()
    view = look(drive, scene_map([HALL], [drive]), replace(CONFIG, map_margin_m=margin_m))
    low = np.array(view.occupancy.origin_xy_m)
    high = low + CELL_M * np.array(view.occupancy.cells.shape[::-1])
    for corner, edge in ((drive.xy_m.min(axis=0) - margin_m, low), (drive.xy_m.max(axis=0) + margin_m, high)):
        assert np.abs(corner - edge).max() <= CELL_M + 1e-9
    assert (low <= drive.xy_m.min(axis=0) - margin_m + 1e-9).all()
    assert view.geodesic_m.shape == view.occupancy.cells.shape
    outside = view.occupancy.cells[:, : max(0, -view.occupancy.origin_cell[0] - 1)]
    assert (outside == UNKNOWN).all()


# what the robot swept


def test_nothing_is_freed_where_the_floor_is_known():
    drive = along_x()
    assert look(drive, scene_map([HALL], [drive])).freed_cells == 0


def test_unknown_cells_under_the_robot_are_freed_and_counted_and_others_stay_unknown():
    drive = along_x()
    scene = scene_map([HALL], [drive], keep=lambda xyz: (xyz[:, 1] > 1.3) | (xyz[:, 1] < 0))
    error = refusal(drive, scene)
    assert (error.reason, error.details["unknown_path_share"]) == (Reason.PATH_OFF_MAP, 1.0)
    view = look(drive, scene, dataset=UNSEEN)
    x, y = np.meshgrid(*(np.arange(n) + 0.5 for n in view.occupancy.cells.shape[::-1]))
    x, y = (x + view.occupancy.origin_cell[0]) * CELL_M, (y + view.occupancy.origin_cell[1]) * CELL_M
    along = np.clip(x, drive.xy_m[0, 0], drive.xy_m[-1, 0])
    swept = np.hypot(x - along, y - drive.xy_m[0, 1]) <= DATASET.robot.radius_m
    unknown_before = (y > 0) & (y < 1.3)
    assert view.freed_cells == (swept & unknown_before).sum() > 300
    assert (view.occupancy.cells[swept] == FREE).all()
    assert (view.occupancy.cells[unknown_before & ~swept & (x > 0) & (x < 4)] == UNKNOWN).all()
    assert np.isfinite(view.geodesic_m[swept]).all()


def test_holes_are_filled_where_that_is_asked_for_and_counted_with_the_swept_cells():
    drive = along_x()
    column = np.float32([3.075, 2.325])  # one cell of the floor, seen by nobody and swept by nobody
    scene = scene_map([HALL], [drive], keep=lambda xyz: np.abs(xyz[:, :2] - column).max(axis=1) > CELL_M / 2)
    plain, filled = look(drive, scene), look(drive, scene, replace(CONFIG, fill_holes_cells=1))
    cell = cell_of(plain, *column)
    assert (plain.occupancy.cells[cell], plain.freed_cells) == (UNKNOWN, 0)
    assert (filled.occupancy.cells[cell], filled.freed_cells) == (FREE, 1)
    assert np.isinf(plain.geodesic_m[cell])
    assert np.isfinite(filled.geodesic_m[cell])


def test_a_floor_of_which_nothing_was_seen_is_what_the_robot_swept_and_no_larger():
    upstairs = moved(along_x(room=UPSTAIRS), xy_m=along_x().xy_m + 900.0)
    view = look(upstairs, scene_map([HALL], [upstairs]), NARROW, UNSEEN)
    assert view.freed_cells == (view.occupancy.cells == FREE).sum() > 0
    assert view.occupancy.cells.size < 100 * 100
    assert view.distance_m[-1] == 0


# the robot's own map


def test_a_table_is_free_space_for_a_low_robot_and_an_obstacle_for_a_tall_one():
    low = along_x()
    tall = moved(low, height_m=0.9)
    table = [(1.5 + 0.02 * i, 0.6 + 0.02 * j, 0.7) for i in range(15) for j in range(15)]
    scene = scene_map([HALL], [low], extra=table)
    assert look(low, scene).occupancy.cells[cell_of(look(low, scene), 1.6, 0.7)] == FREE
    error = refusal(tall, scene)
    assert error.reason is Reason.PATH_THROUGH_OBSTACLE
    assert error.details["min_clearance_m"] == 0.0


def test_furniture_on_another_floor_is_not_in_the_way():
    drives = [along_x(room=UPSTAIRS, y_m=1.7), along_x()]
    scene = scene_map([HALL, UPSTAIRS], drives)
    view = look(drives[0], scene)
    assert (view.occupancy.cells[cell_of(view, 1.83, 1.7)]) == FREE  # the pillar stands below
    assert look(drives[1], scene).occupancy.cells[cell_of(look(drives[1], scene), 1.83, 1.7)] == OCCUPIED


# refusals


def test_how_near_a_path_may_come_to_obstacles_is_the_manifests():
    """The hall is 3 m wide: no path keeps 1.6 m from both of its walls."""
    drive = along_x()
    strict = replace(DATASET, checks=CheckLimits(min_path_clearance_m=1.6))
    with pytest.raises(DataError, match=r"must keep 1\.60 m from obstacles"):
        look(drive, scene_map([HALL], [drive]), dataset=strict)


def test_a_path_through_an_obstacle_is_refused_with_the_nearest_frame_and_its_clearance():
    drive = along_x(y_m=1.45)  # 5 cm beside the pillar
    error = refusal(drive, scene_map([HALL], [drive]))
    assert error.reason is Reason.PATH_THROUGH_OBSTACLE
    assert error.details["min_clearance_m"] == pytest.approx(0.05, abs=1e-9)
    assert drive.xy_m[error.details["frame"], 0] == pytest.approx(1.6)
    assert error.details["frames"] == 3  # the ways from x = 1.6, 1.85 and 2.1 m lead past the pillar


def test_a_goal_behind_a_gap_that_is_too_narrow_is_refused_with_the_frames_that_cannot_reach_it():
    gap = Room(boxes=(((1.4, 0.0, 0.0), (1.7, 0.6, 2.5)), ((1.4, 1.0, 0.0), (1.7, 3.0, 2.5))))
    drive = along_x(room=gap)  # through a gap of 0.4 m, where a disc of 0.25 m needs 0.5 m
    error = refusal(drive, scene_map([gap], [drive]))
    assert error.reason is Reason.GOAL_UNREACHABLE
    assert error.details["frame"] == 0
    assert 1 <= error.details["frames"] < len(drive.xy_m)


@pytest.mark.parametrize("offset_m", [1e5, 1e12])
def test_a_path_far_from_its_map_is_refused_before_a_map_is_made_that_fills_the_memory(offset_m):
    drive = along_x()
    error = refusal(moved(drive, xy_m=drive.xy_m + offset_m), scene_map([HALL], [drive]))
    assert error.reason is Reason.MAP_TOO_LARGE
    assert error.details["columns"] * error.details["rows"] > MAX_MAP_CELLS
    assert error.details["columns"] == pytest.approx(offset_m / CELL_M, rel=1e-2)


def test_what_is_measured_is_what_the_parts_measure():
    """The view wires crop, sweep and field together and changes nothing of them."""
    drive = along_x()
    scene, record = scene_map([HALL], [drive], keep=lambda xyz: xyz[:, 0] > 1.0), record_of(drive)
    floor = occupancy_for(scene, record.floor_z_m, record.camera_height_m, DATASET.robot)
    wide = crop_around(floor, np.array([[-3.0, -3.0], [7.0, 7.0]]), 0.0)
    freed, count = free_swept_cells(wide, drive.xy_m, DATASET.robot.radius_m)
    field_m = geodesic_distance(freed, drive.xy_m[-1], DATASET.robot.radius_m, CONFIG.goal_radius_m)
    view = look(drive, scene)
    column, row = (a - b for a, b in zip(view.occupancy.origin_cell, wide.origin_cell, strict=True))
    rows, columns = view.occupancy.cells.shape
    assert view.freed_cells == count > 0
    np.testing.assert_array_equal(view.geodesic_m, field_m[row : row + rows, column : column + columns])
