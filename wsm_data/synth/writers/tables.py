"""The parquet file of an episode, with the columns that the public loader of InternData-N1 reads."""

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.synth.config import Matrices
from wsm_data.synth.drive.expert import Episode


def episode_table(episode: Episode, intrinsics: Intrinsics, first_index: int, matrices: Matrices) -> bytes:
    """One row per frame: index, camera matrix, mount, and the camera's pose (OpenGL axes, camera to world).

    Args:
        episode: the recording.
        intrinsics: of its images.
        first_index: global number of its first frame.
        matrices: how matrices are held.
    """
    frames = len(episode.T_world_opengl)
    K = np.broadcast_to(intrinsics.matrix.astype(np.float32), (frames, 3, 3))
    mount = np.broadcast_to(episode.T_base_camera, (frames, 4, 4))
    columns = {
        "index": pa.array(np.arange(first_index, first_index + frames, dtype=np.int64)),
        "observation.camera_intrinsic": _matrix_column(K, matrices),
        "observation.camera_extrinsic": _matrix_column(mount, matrices),
        "action": _matrix_column(episode.T_world_opengl, matrices),
    }
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink, compression="snappy")
    return sink.getvalue()


def _matrix_column(values: Float32Array, matrices: Matrices) -> pa.Array:
    """Matrices [T, N, N] as lists of lists of float, or as lists of N * N floats."""
    count, rows, columns = values.shape
    floats = pa.array(np.ascontiguousarray(values).reshape(-1))
    if matrices == Matrices.FLAT:
        return pa.ListArray.from_arrays(_offsets(count, rows * columns), floats)
    lines = pa.ListArray.from_arrays(_offsets(count * rows, columns), floats)
    return pa.ListArray.from_arrays(_offsets(count, rows), lines)


def _offsets(count: int, length: int) -> pa.Array:
    return pa.array(np.arange(count + 1, dtype=np.int32) * length)
