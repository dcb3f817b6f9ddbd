from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason, WsmError
from wsm_data.readers.lerobot.meta import EpisodePlace
from wsm_data.readers.lerobot.rows import read_rows
from wsm_data.schema.source.lerobot_features import PoseForm

POSE = "observation.camera_pose"
FRAMES = 5


def written(folder, **columns):
    """A file of two episodes, of which number 1 is asked for."""
    rng = np.random.default_rng(0)
    turns = Rotation.random(FRAMES, rng=rng).as_matrix()
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = turns, rng.uniform(-3, 3, (FRAMES, 3))
    table = {
        "timestamp": np.arange(FRAMES) / 10,
        "frame_index": np.arange(FRAMES),
        POSE: T.reshape(FRAMES, 16).tolist(),
    }
    own = pa.table({**table, "episode_index": np.full(FRAMES, 1), **columns})
    other = own.set_column(own.column_names.index("episode_index"), "episode_index", pa.array([0] * FRAMES))
    pq.write_table(pa.concat_tables([other, own]), folder / "data.parquet")
    return T


def read(folder, dataset, length=FRAMES, **features):
    place = EpisodePlace(index=1, length=length, data_file="data.parquet", videos={})
    return read_rows(folder, place, replace(dataset, features=replace(dataset.features, **features)), "here")


def test_rows_of_one_episode_are_read_out_of_a_shared_file(tmp_path, dataset):
    T = written(tmp_path)
    rows = read(tmp_path, dataset)
    assert np.array_equal(rows.T_world_camera, T)
    assert rows.times_s.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert rows.intrinsics is None


@pytest.mark.parametrize("form", [PoseForm.XYZ_WXYZ, PoseForm.XYZ_XYZW])
def test_positions_and_quaternions_are_poses_too(tmp_path, dataset, form):
    T = written(tmp_path)
    xyzw = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    quaternion = xyzw if form is PoseForm.XYZ_XYZW else xyzw[:, [3, 0, 1, 2]]
    written(tmp_path, **{POSE: np.concatenate([T[:, :3, 3], quaternion], axis=1).tolist()})
    assert np.abs(read(tmp_path, dataset, pose_form=form).T_world_camera - T).max() < 1e-12


def test_axes_of_camera_and_world_are_those_of_the_manifest(tmp_path, dataset):
    T = written(tmp_path)
    opengl = replace(dataset, camera_axes="opengl")
    assert np.abs(read(tmp_path, opengl).T_world_camera - T @ np.diag([1, -1, -1, 1])).max() < 1e-12


@pytest.mark.parametrize("K", [[50.0, 51.0, 31.0, 23.0], [[50.0, 0.0, 31.0], [0.0, 51.0, 23.0], [0.0, 0.0, 1.0]]])
def test_the_camera_may_be_a_feature_flat_or_nested(tmp_path, dataset, K):
    written(tmp_path, K=[K] * FRAMES)
    assert read(tmp_path, dataset, intrinsics="K").intrinsics == (50.0, 51.0, 31.0, 23.0)


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"frame_index": [0, 1, 3, 2, 4]}, Reason.TABLE_ROW_ORDER),
        ({"timestamp": [0.0, 0.1, 0.1, 0.3, 0.4]}, Reason.TABLE_ROW_ORDER),
        ({"timestamp": [0.0, 0.1, float("nan"), 0.3, 0.4]}, Reason.TABLE_ROW_ORDER),
        ({POSE: [[0.0] * 16] * FRAMES}, Reason.POSE_NOT_RIGID),
        ({POSE: [[float("inf")] * 16] * FRAMES}, Reason.POSE_NOT_FINITE),
        ({POSE: [[1.0] * 16] * 4 + [[1.0] * 15]}, Reason.TABLE_BAD_SHAPE),
    ],
)
def test_rows_that_cannot_be_are_refused(tmp_path, dataset, columns, reason):
    written(tmp_path, **columns)
    with pytest.raises(DataError) as caught:
        read(tmp_path, dataset)
    assert caught.value.reason is reason


def test_another_number_of_rows_than_the_table_of_episodes_says_is_refused(tmp_path, dataset):
    written(tmp_path)
    with pytest.raises(DataError) as caught:
        read(tmp_path, dataset, length=6)
    assert caught.value.reason is Reason.TABLE_ROW_COUNT


@settings(max_examples=40, deadline=None)
@given(places=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=8))
def test_a_table_with_changed_bytes_is_read_or_refused(tmp_path_factory, dataset, places):
    from wsm_data.readers.guard import refusing_unparsable

    folder = tmp_path_factory.mktemp("any")
    written(folder)
    data = bytearray((folder / "data.parquet").read_bytes())
    for share, value in places:
        data[min(int(share * len(data)), len(data) - 1)] = value
    (folder / "data.parquet").write_bytes(data)
    try:
        with refusing_unparsable("here"):
            read(folder, dataset)
    except WsmError as error:
        assert str(error)  # noqa: PT017
