"""The expert's path, which trajectory folders draw into their cloud, taken out again."""

import numpy as np

from wsm_data.schema.arrays import BoolArray
from wsm_data.schema.dataset import CloudColours
from wsm_data.schema.point_cloud import PointCloud


def without_path(cloud: PointCloud, colours: CloudColours) -> PointCloud:
    """The points of a cloud that do not have the path's colour; the cloud itself where none has it."""
    on_path: BoolArray = _distance(cloud, colours.path_rgb) < colours.tolerance * 255
    if not on_path.any():
        return cloud
    return PointCloud(xyz_m=cloud.xyz_m[~on_path], rgb_u8=cloud.rgb_u8[~on_path])


def _distance(cloud: PointCloud, rgb: tuple[float, float, float]) -> np.ndarray:
    """Sum over the channels of |difference| to a colour in [0, 1], of 255; a channel has 256 values, so by table."""
    levels = np.arange(256)
    red, green, blue = (np.abs(levels - value * 255)[cloud.rgb_u8[:, i]] for i, value in enumerate(rgb))
    return red + green + blue
