"""A hall with and without its cloud."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, HALL, along_x, cloud_points, frames_of, record_of

from wsm_data.clips.scene_surface import scene_surface
from wsm_data.errors import DataError, Reason
from wsm_data.maps.voxels import voxels_digest, voxels_from_cloud
from wsm_data.readers.source import ContainerScan
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.point_cloud import PointCloud

DRIVE = along_x()
RECORD = record_of(DRIVE)
SAMPLES = {RECORD.id.text: tuple(enumerate(frames_of(DRIVE).depth))}


def scan(cloud=None, samples=None):
    return ContainerScan(
        records=(RECORD,), refusals=(), cloud=cloud, cloud_refusal=None, depth_samples=samples or {}, bytes_read=1
    )


def test_a_scene_with_a_cloud_has_the_surface_of_its_cloud():
    xyz_m, obstacle = cloud_points([HALL])
    rgb_u8 = np.where(obstacle[:, None], (0, 0, 128), (200, 200, 200)).astype(np.uint8)
    cloud = PointCloud(xyz_m=xyz_m, rgb_u8=rgb_u8)
    found = scene_surface(scan(cloud, SAMPLES), [RECORD], DATASET)
    assert found.origin == "cloud"
    assert voxels_digest(found) == voxels_digest(voxels_from_cloud(cloud, DATASET.cloud))


def test_a_trajectory_that_contradicts_its_depth_adds_nothing_to_a_surface_from_depth():
    alone = scene_surface(scan(samples=SAMPLES), [RECORD], DATASET)
    wrong = replace(
        RECORD,
        id=EpisodeId("box_d435i", "hall", "000009"),
        T_world_camera=RECORD.T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0]),  # OpenGL axes taken for OpenCV's
    )
    samples = {**SAMPLES, wrong.id.text: SAMPLES[RECORD.id.text]}
    together = scene_surface(scan(samples=samples), [RECORD, wrong], DATASET)
    assert alone.origin == "depth"
    assert voxels_digest(together) == voxels_digest(alone)


def test_a_scene_without_cloud_and_without_depth_has_an_empty_surface():
    assert len(scene_surface(scan(), [RECORD], DATASET).cells) == 0


def test_a_cloud_without_obstacles_is_refused():
    xyz_m = cloud_points([HALL])[0]
    grey = PointCloud(xyz_m=xyz_m, rgb_u8=np.full(xyz_m.shape, 200, np.uint8))
    with pytest.raises(DataError) as caught:
        scene_surface(scan(grey), [RECORD], DATASET)
    assert caught.value.reason is Reason.CLOUD_NO_OBSTACLES
