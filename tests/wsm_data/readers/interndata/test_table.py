import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.interndata.table import INTRINSIC_COLUMN, MOUNT_COLUMN, POSE_COLUMN, read_table


def reason_of(data):
    with pytest.raises(DataError, match="episode 3") as caught:
        read_table(memoryview(data), "episode 3", 10**6)
    return caught.value.reason


def parquet(**columns):
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


@pytest.mark.parametrize("nested", [True, False])
def test_nested_and_flat_matrices_are_the_same(build, nested):
    episode = build.episode(0)
    table = read_table(memoryview(build.table(episode, nested=nested)), "a", 10**6)
    assert np.array_equal(table.T_world_stored, episode.poses.astype(np.float64))
    assert np.array_equal(table.T_mount, episode.mount.astype(np.float64))
    assert np.array_equal(table.K, episode.K.astype(np.float64))


def test_fixed_size_large_and_double_lists_are_read_too(build):
    episode = build.episode(0)
    K, mount, poses = (np.asarray(a, np.float64) for a in (episode.K, episode.mount, episode.poses))
    rows = len(poses)
    data = parquet(
        **{
            INTRINSIC_COLUMN: pa.array([K.ravel().tolist()] * rows, pa.list_(pa.float64(), 9)),
            MOUNT_COLUMN: pa.array([mount.tolist()] * rows, pa.large_list(pa.large_list(pa.float64()))),
            POSE_COLUMN: pa.chunked_array([pa.array(half.tolist()) for half in (poses[:3], poses[3:])]),
        }
    )
    table = read_table(memoryview(data), "a", 10**6)
    assert np.array_equal(table.T_world_stored, poses)
    assert np.array_equal(table.T_mount, mount)
    assert np.array_equal(table.K, K)


@pytest.mark.parametrize(
    "damage", [lambda d: b"", lambda d: b"PAR1", lambda d: d[:-20], lambda d: d[:4] + b"\xff" * 600]
)
def test_a_damaged_table_is_unreadable(build, damage):
    assert reason_of(damage(build.table(build.episode(0)))) is Reason.TABLE_UNREADABLE


@pytest.mark.parametrize("column", [INTRINSIC_COLUMN, MOUNT_COLUMN, POSE_COLUMN])
def test_a_missing_column_is_named(build, column):
    with pytest.raises(DataError, match=f"{column} is missing") as caught:
        read_table(memoryview(build.table(build.episode(0), drop=column)), "a", 10**6)
    assert caught.value.reason is Reason.TABLE_MISSING_COLUMN
    assert caught.value.details["missing"] == [column]


@pytest.mark.parametrize(
    "poses",
    [
        pa.array([[1.0] * 12] * 7),
        pa.array([[[1.0] * 4] * 3] * 7),
        pa.array([[1.0] * 16] * 6 + [[1.0] * 15]),  # ragged
        pa.array([[1.0] * 17, [1.0] * 15] * 3 + [[1.0] * 16]),  # ragged, with the right sum
        pa.array([[1.0] * 16] * 6 + [None]),
        pa.array([[1.0] * 16] * 6 + [[None] * 16]),
        pa.array([["1"] * 16] * 7),
        pa.array([1.0] * 7),
        pa.array([b"\x80\x04pickle"] * 7),
    ],
)
def test_anything_but_square_matrices_of_numbers_has_a_bad_shape(build, poses):
    table = pq.read_table(io.BytesIO(build.table(build.episode(0)))).to_pydict()
    del table[POSE_COLUMN]
    assert reason_of(parquet(**table, **{POSE_COLUMN: poses})) is Reason.TABLE_BAD_SHAPE


def test_a_table_without_rows_has_a_bad_shape(build):
    episode = build.episode(0)
    episode.poses = episode.poses[:0]
    assert reason_of(build.table(episode)) is Reason.TABLE_BAD_SHAPE


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(build, value):
    poses = build.episode(0)
    poses.poses[4, 0, 3] = value
    assert reason_of(build.table(poses)) is Reason.POSE_NOT_FINITE
    mount = build.episode(0)
    mount.mount[2, 3] = value
    assert reason_of(build.table(mount)) is Reason.POSE_NOT_FINITE
    camera = build.episode(0)
    camera.K[0, 0] = value
    assert reason_of(build.table(camera)) is Reason.INTRINSICS_MISFIT


@pytest.mark.parametrize(
    "change",
    [
        np.diag([1.01, 1.01, 1.01, 1.0]),  # scaled
        np.diag([-1.0, 1.0, 1.0, 1.0]),  # mirrored
        np.array([[1, 0.01, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),  # sheared
        np.diag([1.0, 1.0, 1.0, 2.0]),
        np.zeros((4, 4)),
    ],
)
def test_a_matrix_that_is_not_rigid_is_refused_with_its_row(build, change):
    episode = build.episode(0)
    episode.poses[5] = change @ episode.poses[5]
    with pytest.raises(DataError) as caught:
        read_table(memoryview(build.table(episode)), "a", 10**6)
    assert (caught.value.reason, caught.value.details["row"]) == (Reason.POSE_NOT_RIGID, 5)
    mount = build.episode(0)
    mount.mount = (change @ mount.mount).astype(np.float32)
    assert reason_of(build.table(mount)) is Reason.POSE_NOT_RIGID


def test_rounding_to_float32_and_to_four_digits_counts_as_rigid(build):
    episode = build.episode(0)
    episode.poses = np.round(episode.poses, 4)  # R^T R is off by up to 4 * 0.5e-4 = 2e-4, the tolerance is 1e-3
    assert len(read_table(memoryview(build.table(episode)), "a", 10**6).T_world_stored) == 7


def test_intrinsics_that_change_within_an_episode_are_refused(build):
    episode = build.episode(0)
    K = np.repeat(episode.K[None], 7, axis=0)
    K[3, 0, 0] += 0.01
    assert reason_of(build.table(episode, K=K)) is Reason.INTRINSICS_MISFIT


def test_a_mount_that_changes_within_an_episode_is_refused(build):
    episode = build.episode(0)
    mount = np.repeat(episode.mount[None], 7, axis=0)
    mount[3, 2, 3] += 0.001
    assert reason_of(build.table(episode, mount=mount)) is Reason.MOUNT_MISFIT
    assert reason_of(build.table(episode, mount=episode.poses)) is Reason.MOUNT_MISFIT  # a trajectory is no mount


@pytest.mark.parametrize("start", [0, 4711])
def test_rows_may_be_counted_from_any_number(build, start):
    episode = build.episode(0)
    data = build.table(episode, index=np.arange(start, start + 7))
    assert len(read_table(memoryview(data), "a", 10**6).T_world_stored) == 7


@pytest.mark.parametrize(
    ("index", "row"), [([0, 1, 3, 2, 4, 5, 6], 2), ([0, 1, 2, 2, 3, 4, 5], 3), ([6, 5, 4, 3, 2, 1, 0], 1)]
)
def test_rows_that_do_not_count_up_by_one_are_refused_with_the_row(build, index, row):
    data = build.table(build.episode(0), index=np.array(index))
    with pytest.raises(DataError, match=rf"row {row} has {index[row]} after {index[row - 1]}") as caught:
        read_table(memoryview(data), "a", 10**6)
    assert (caught.value.reason, caught.value.details["row"]) == (Reason.TABLE_ROW_ORDER, row)


def test_a_table_without_an_index_is_taken_in_its_order(build):
    episode = build.episode(0)
    table = read_table(memoryview(build.table(episode, drop="index")), "a", 10**6)
    assert np.array_equal(table.T_world_stored, episode.poses.astype(np.float64))


def test_an_index_that_is_no_number_is_refused(build):
    assert reason_of(build.table(build.episode(0), index=np.array(list("abcdefg")))) is Reason.TABLE_BAD_SHAPE
