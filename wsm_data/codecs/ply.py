"""Coloured point clouds as PLY files: the one place that writes them."""

import numpy as np

from wsm_data.schema.point_cloud import PointCloud

_VERTEX = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])


def ply_bytes(cloud: PointCloud) -> bytes:
    """The cloud as a binary little-endian PLY file with float x, y, z and uchar red, green, blue."""
    properties = [f"property float {axis}" for axis in "xyz"]
    properties += [f"property uchar {channel}" for channel in ("red", "green", "blue")]
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(cloud.xyz_m)}",
        *properties,
        "end_header",
        "",
    ]
    vertices = np.empty(len(cloud.xyz_m), _VERTEX)
    vertices["xyz"], vertices["rgb"] = cloud.xyz_m, cloud.rgb_u8
    return "\n".join(lines).encode() + vertices.tobytes()
