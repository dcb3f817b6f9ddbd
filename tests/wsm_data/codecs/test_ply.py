import io

import numpy as np
import trimesh

from wsm_data.codecs.ply import ply_bytes
from wsm_data.schema.point_cloud import PointCloud


def test_the_bytes_are_a_ply_that_others_read():
    rng = np.random.default_rng(0)
    cloud = PointCloud(
        xyz_m=rng.normal(size=(50, 3)).astype(np.float32), rgb_u8=rng.integers(0, 256, (50, 3)).astype(np.uint8)
    )
    loaded = trimesh.load(io.BytesIO(ply_bytes(cloud)), file_type="ply")
    assert (np.asarray(loaded.vertices, np.float32) == cloud.xyz_m).all()
    assert (np.asarray(loaded.colors)[:, :3] == cloud.rgb_u8).all()
