import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.readers.interndata.path_points import without_path
from wsm_data.schema.dataset import CloudColours
from wsm_data.schema.point_cloud import PointCloud


def cloud_of(colours):
    rgb = np.array(colours, np.uint8).reshape(-1, 3)
    return PointCloud(xyz_m=np.arange(3 * len(rgb), dtype=np.float32).reshape(-1, 3), rgb_u8=rgb)


colour = st.tuples(*[st.integers(0, 255)] * 3)


@given(colours=st.lists(colour, max_size=20), path=colour, tolerance=st.floats(0, 3))
def test_points_go_when_their_summed_difference_to_the_paths_colour_is_under_the_tolerance(colours, path, tolerance):
    cloud = cloud_of(colours)
    rgb = tuple(value / 255 for value in path)
    kept = without_path(cloud, CloudColours(path_rgb=rgb, tolerance=tolerance))
    expected = [
        i
        for i, own in enumerate(colours)
        if not sum(abs(a - 255 * b) for a, b in zip(own, rgb, strict=True)) < 255 * tolerance
    ]
    assert np.array_equal(kept.xyz_m, cloud.xyz_m[expected])
    assert np.array_equal(kept.rgb_u8, cloud.rgb_u8[expected])


@pytest.mark.parametrize(("colour", "goes"), [((12, 0, 0), True), ((6, 6, 0), True), ((5, 5, 3), False)])
def test_black_is_what_sums_to_less_than_a_twentieth(colour, goes):
    # 12 / 255 = 0.047 and 13 / 255 = 0.051 around the published tolerance of 0.05
    assert (len(without_path(cloud_of([colour]), CloudColours()).xyz_m) == 0) is goes


def test_a_cloud_without_a_path_is_not_copied():
    cloud = cloud_of([(9, 9, 9), (0, 0, 128)])
    assert without_path(cloud, CloudColours()) is cloud
