import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.synth.config import CAMERAS
from wsm_data.synth.drive.expert import Episode
from wsm_data.synth.writers.tables import episode_table

POSES = np.random.default_rng(0).normal(size=(5, 4, 4)).astype(np.float32)
EPISODE = Episode(T_world_opengl=POSES, camera_height_m=0.8, camera_pitch_rad=0.2)
SHAPES = {"observation.camera_intrinsic": (3, 3), "observation.camera_extrinsic": (4, 4), "action": (4, 4)}


def read(matrices: str) -> pa.Table:
    return pq.read_table(io.BytesIO(episode_table(EPISODE, CAMERAS["d435i"], 40, matrices)))


@pytest.mark.parametrize("matrices", ["nested", "flat"])
def test_a_table_has_the_columns_of_the_real_set_and_their_numbers(matrices):
    table = read(matrices)
    assert table.column_names == ["index", *SHAPES]
    assert table["index"].to_pylist() == [40, 41, 42, 43, 44]
    values = {name: np.array(table[name].to_pylist(), np.float32).reshape(5, *shape) for name, shape in SHAPES.items()}
    assert (values["action"] == POSES).all()
    assert (values["observation.camera_intrinsic"] == CAMERAS["d435i"].matrix.astype(np.float32)).all()
    assert (values["observation.camera_extrinsic"] == EPISODE.T_base_camera).all()


def test_lists_are_of_float32_nested_or_flat():
    assert read("nested").schema.field("action").type == pa.list_(pa.list_(pa.float32()))
    assert read("flat").schema.field("action").type == pa.list_(pa.float32())
    assert read("flat").schema.field("index").type == pa.int64()


def test_equal_episodes_have_equal_bytes():
    assert episode_table(EPISODE, CAMERAS["zed"], 0, "flat") == episode_table(EPISODE, CAMERAS["zed"], 0, "flat")
