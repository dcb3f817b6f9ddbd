"""A point cloud may be a view into a file's bytes, and has a colour for every point."""

import numpy as np
import pytest

from wsm_data.schema.point_cloud import PointCloud

RECORD = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])


def test_strided_views_into_records_are_accepted_without_a_copy():
    records = np.zeros(10, RECORD)
    cloud = PointCloud(xyz_m=records["xyz"], rgb_u8=records["rgb"])
    assert np.shares_memory(cloud.xyz_m, records)
    assert np.shares_memory(cloud.rgb_u8, records)


def test_an_empty_cloud_is_a_cloud():
    PointCloud(xyz_m=np.zeros((0, 3), np.float32), rgb_u8=np.zeros((0, 3), np.uint8))


@pytest.mark.parametrize(
    ("xyz_m", "rgb_u8", "named"),
    [
        (np.zeros((5, 3)), np.zeros((5, 3), np.uint8), "xyz_m"),
        (np.zeros((5, 2), np.float32), np.zeros((5, 3), np.uint8), "xyz_m"),
        (np.zeros((5, 3), np.float32), np.zeros((4, 3), np.uint8), "rgb_u8"),
        (np.zeros((5, 3), np.float32), np.zeros((5, 4), np.uint8), "rgb_u8"),
        (np.zeros((5, 3), np.float32), np.zeros((5, 3), np.float32), "rgb_u8"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(xyz_m, rgb_u8, named):
    with pytest.raises(ValueError, match=f"^{named} must be "):
        PointCloud(xyz_m=xyz_m, rgb_u8=rgb_u8)
