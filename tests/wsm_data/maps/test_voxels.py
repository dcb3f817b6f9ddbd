import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.maps.voxels import (
    load_voxels,
    no_voxels,
    save_voxels,
    voxels_digest,
    voxels_from_cloud,
    voxels_from_depth,
)
from wsm_data.schema.dataset import CloudColours
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.surface import SurfaceVoxels

GREY, OBSTACLE, BLACK = (128, 128, 128), (0, 0, 128), (0, 0, 0)


def cloud_of(points, colours):
    return PointCloud(
        xyz_m=np.array(points, np.float32).reshape(-1, 3), rgb_u8=np.array(colours, np.uint8).reshape(-1, 3)
    )


def random_points(seed, count=500, span_m=0.4):
    return np.random.default_rng(seed).uniform(-span_m, span_m, (count, 3))


def as_table(voxels):
    return {(*map(int, cell), bool(mark)) for cell, mark in zip(voxels.cells, voxels.obstacle, strict=True)}


def test_points_fall_into_boxes_of_five_by_five_by_one_centimetre():
    voxels = voxels_from_cloud(cloud_of([[0.01, 0.06, 0.005], [-0.01, 0.02, -0.001]], [GREY, OBSTACLE]), CloudColours())
    assert voxels.cells.tolist() == [[-1, 0, -1], [0, 1, 0]]
    assert voxels.obstacle.tolist() == [True, False]
    assert voxels.origin == "cloud"


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_boxes_are_sorted_unique_and_marked_if_any_of_their_points_is(seed):
    points = random_points(seed).astype(np.float32)
    marks = np.random.default_rng(seed).random(len(points)) < 0.2
    marks[0] = True
    colours = np.where(marks[:, None], OBSTACLE, GREY)
    voxels = voxels_from_cloud(cloud_of(points, colours), CloudColours())
    expected = {}
    for (x, y, z), mark in zip(points.astype(np.float64), marks, strict=True):
        cell = (int(np.floor(x * 20)), int(np.floor(y * 20)), int(np.floor(z * 100)))
        expected[cell] = expected.get(cell, False) or bool(mark)
    assert [tuple(cell) for cell in voxels.cells.tolist()] == sorted(expected)
    assert voxels.obstacle.tolist() == [expected[cell] for cell in sorted(expected)]


def test_the_order_of_points_changes_nothing():
    points = random_points(1).astype(np.float32)
    colours = np.where(np.arange(len(points))[:, None] % 3 == 0, OBSTACLE, GREY)
    order = np.random.default_rng(2).permutation(len(points))
    one = voxels_from_cloud(cloud_of(points, colours), CloudColours())
    other = voxels_from_cloud(cloud_of(points[order], colours[order]), CloudColours())
    assert voxels_digest(one) == voxels_digest(other)


def test_strided_read_only_views_of_a_files_bytes_are_taken_as_they_are():
    points, colours = random_points(3).astype(np.float32), np.full((500, 3), OBSTACLE, np.uint8)
    rows = np.zeros(500, np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)]))
    rows["xyz"], rows["rgb"] = points, colours
    data = np.frombuffer(rows.tobytes(), rows.dtype)
    assert not data["xyz"].flags.c_contiguous
    strided = voxels_from_cloud(PointCloud(xyz_m=data["xyz"], rgb_u8=data["rgb"]), CloudColours())
    assert voxels_digest(strided) == voxels_digest(voxels_from_cloud(cloud_of(points, colours), CloudColours()))


def test_black_points_are_surface_like_any_other():
    voxels = voxels_from_cloud(cloud_of([[0, 0, 0], [1, 1, 1]], [OBSTACLE, BLACK]), CloudColours())
    assert as_table(voxels) == {(0, 0, 0, True), (20, 20, 100, False)}


def test_colours_are_told_apart_by_the_sum_of_their_differences():
    # |128/255 - 0.5| = 0.002; twelve steps more in one channel make 0.049, in two channels 0.098
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    voxels = voxels_from_cloud(cloud_of(points, [(0, 0, 128), (12, 0, 127), (12, 12, 127)]), CloudColours())
    assert voxels.obstacle.tolist() == [True, True, False]


def test_a_cloud_without_points_is_empty():
    with pytest.raises(DataError) as refused:
        voxels_from_cloud(cloud_of([], []), CloudColours())
    assert refused.value.reason is Reason.CLOUD_EMPTY


def test_a_cloud_in_which_nothing_is_an_obstacle_is_refused():
    with pytest.raises(DataError) as refused:
        voxels_from_cloud(cloud_of([[0, 0, 0]], [GREY]), CloudColours())
    assert refused.value.reason is Reason.CLOUD_NO_OBSTACLES
    assert refused.value.details == {"points": 1}


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1640.0, -1640.0, 1e30])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_coordinate_off_the_grid_is_refused_with_its_index(bad, axis):
    points = np.zeros((5, 3), np.float32)
    points[3, axis] = bad
    with pytest.raises(DataError) as refused:
        voxels_from_cloud(cloud_of(points, [OBSTACLE] * 5), CloudColours())
    assert refused.value.reason is Reason.CLOUD_UNREADABLE
    assert refused.value.details["index"] == 3
    with pytest.raises(DataError) as refused:
        voxels_from_depth([points.astype(np.float64)])
    assert refused.value.reason is Reason.CLOUD_UNREADABLE


def test_the_grid_reaches_as_far_as_16_bits_do():
    edge = voxels_from_depth([np.array([[-1638.4, 1638.375, 327.675], [1638.375, -1638.4, -327.68]])])
    assert edge.cells.tolist() == [[-32768, 32767, 32767], [32767, -32768, -32768]]


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), cuts=st.lists(st.integers(0, 500), max_size=5))
def test_how_fused_points_are_cut_into_chunks_changes_nothing(seed, cuts):
    points = random_points(seed)
    whole = voxels_from_depth([points])
    chunks = np.split(points[::-1], sorted(cuts))
    assert voxels_digest(voxels_from_depth(iter(chunks))) == voxels_digest(whole)
    assert not whole.obstacle.any()
    assert whole.origin == "depth"


def test_many_chunks_are_merged_on_the_way():
    rng = np.random.default_rng(0)
    chunks = [rng.uniform(-20, 20, (60_000, 3)) for _ in range(8)]  # more than waits at once
    assert voxels_digest(voxels_from_depth(chunks)) == voxels_digest(voxels_from_depth([np.concatenate(chunks)]))


def test_no_depth_at_all_is_no_boxes():
    assert len(voxels_from_depth([]).cells) == 0


def test_boxes_survive_the_disk_and_equal_boxes_have_equal_files(tmp_path):
    voxels = voxels_from_depth([random_points(9)])
    save_voxels(tmp_path / "a.npz", voxels)
    loaded = load_voxels(tmp_path / "a.npz")
    save_voxels(tmp_path / "b.npz", loaded)
    assert as_table(loaded) == as_table(voxels)
    assert loaded.origin == "depth"
    assert voxels_digest(loaded) == voxels_digest(voxels)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_file_with_boxes_of_another_kind_is_an_integrity_error(tmp_path):
    np.savez(tmp_path / "x.npz", cells=np.zeros((2, 2), np.int16), obstacle=np.zeros(2, bool), origin=np.array("cloud"))
    with pytest.raises(IntegrityError, match="cells must be int16"):
        load_voxels(tmp_path / "x.npz")


def test_a_scene_that_nothing_shows_has_no_boxes_and_says_so(tmp_path):
    save_voxels(tmp_path / "surface.npz", no_voxels())
    assert load_voxels(tmp_path / "surface.npz").origin == "path"
    with pytest.raises(ValueError, match="must have no box, found 1"):
        SurfaceVoxels(cells=np.zeros((1, 3), np.int16), obstacle=np.zeros(1, bool), origin="path")
