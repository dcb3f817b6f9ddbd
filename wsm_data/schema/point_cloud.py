"""A coloured point cloud of a scene."""

from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float32Array, Uint8Array, require_array


@dataclass(frozen=True, kw_only=True)
class PointCloud:
    """Points of a scene's surface in world coordinates.

    Attributes:
        xyz_m: positions, m; float32 [N, 3]. May be a strided view into the file's own bytes.
        rgb_u8: colours; uint8 [N, 3]. May be a strided view likewise.
    """

    xyz_m: Float32Array
    rgb_u8: Uint8Array

    def __post_init__(self) -> None:
        require_array("xyz_m", self.xyz_m, np.float32, (None, 3))
        require_array("rgb_u8", self.rgb_u8, np.uint8, (len(self.xyz_m), 3))
