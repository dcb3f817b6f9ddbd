"""The coloured point cloud of a scene: surfaces in grey, obstacles near the floor in dark blue, paths in black."""

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.home import Home
from wsm_data.synth.home.sampling import sample_surface

OBSTACLE_RGB = (0, 0, 128)
PATH_RGB = (0, 0, 0)
_DARKEST, _BRIGHTEST = 70, 235


def scene_cloud(home: Home, config: SynthConfig) -> PointCloud:
    """Points on every surface of a home; the same for every camera and layout.

    Floors are covered closely, so that what is free shows as free in maps of 0.05 m cells.
    """
    floor, floor_patch = sample_surface(home.surface, config.floor_spacing_m, home.floor_patch)
    other, other_patch = sample_surface(home.surface, config.surface_spacing_m, ~home.floor_patch)
    xyz, owner = np.concatenate([floor, other]), np.concatenate([floor_patch, other_patch])
    grey = (_DARKEST + (_BRIGHTEST - _DARKEST) * home.mean_colour[owner].mean(axis=1)).astype(np.uint8)
    rgb = np.repeat(grey[:, None], 3, axis=1)
    low, high = config.obstacle_slice_m
    rgb[(xyz[:, 2] > low) & (xyz[:, 2] < high)] = OBSTACLE_RGB
    return PointCloud(xyz_m=xyz.astype(np.float32), rgb_u8=rgb)


def with_path(cloud: PointCloud, path_m: Float64Array) -> PointCloud:
    """The cloud followed by the points of an expert's path [T, 3], m, in black."""
    black = np.tile(np.array(PATH_RGB, np.uint8), (len(path_m), 1))
    return PointCloud(
        xyz_m=np.concatenate([cloud.xyz_m, path_m.astype(np.float32)]),
        rgb_u8=np.concatenate([cloud.rgb_u8, black]),
    )
