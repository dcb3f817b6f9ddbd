"""A path on the floor of an analytic room; what becomes of the map is held against formulas in test_scene_view."""

import numpy as np
from box_room import DATASET, HALL, Drive, Room, along_x, cloud_points, record_of

from wsm_data.clips.config import ClipConfig
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.errors import Reason
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_cloud
from wsm_data.schema.point_cloud import PointCloud

BLOCK = Room(boxes=(((1.0, 0.5, 0.0), (2.5, 2.0, 2.5)),))
"""A thing of 1.5 m x 1.5 m; its cloud shows the outside, and its inside is unknown."""


def verdicts_of(drive, room):
    xyz, obstacle = cloud_points([room])
    rgb = np.where(obstacle[:, None], (0, 0, 128), (200, 200, 200)).astype(np.uint8)
    voxels = voxels_from_cloud(PointCloud(xyz_m=xyz, rgb_u8=rgb), DATASET.cloud)
    scene = build_scene_map(voxels, (0.0,), DATASET.robot, 2.0)
    return lay_path(record_of(drive), scene, DATASET, ClipConfig()).verdicts


def test_a_sound_path_is_kept_with_its_numbers_and_limits():
    verdicts = verdicts_of(along_x(), HALL)
    assert {name: verdict.reason for name, verdict in verdicts.items()} == {"path_shown": None, "expert_path": None}
    assert verdicts["path_shown"].measured["unknown_path_share"] == 0.0
    assert verdicts["expert_path"].limits == {"min_clearance_m": 0.1}


def test_a_goal_inside_of_a_thing_is_found_where_the_way_leads_through_its_surface():
    """From 0.4 m before the block to its middle, in one step: both ends keep 0.3 m from what the cloud shows."""
    drive = Drive(room=BLOCK, xy_m=np.array([[0.4, 1.2], [0.6, 1.2], [1.75, 1.25], [1.75, 1.25]]), yaw_rad=np.zeros(4))
    verdict = verdicts_of(drive, BLOCK)["expert_path"]
    assert verdict.reason is Reason.PATH_THROUGH_OBSTACLE
    assert (verdict.measured["frame"], verdict.measured["frames"]) == (1, 1)  # the step that begins at frame 1
    assert verdict.measured["min_clearance_m"] == 0.0
