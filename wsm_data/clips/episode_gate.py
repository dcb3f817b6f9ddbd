"""Is a trajectory sound? What its images, its poses and the map of its scene say of one another."""

import math
from itertools import chain

import numpy as np

from wsm_data.checks.cloud_agreement import check_cloud_agreement, height_bands
from wsm_data.checks.colour_agreement import check_colour_agreement
from wsm_data.checks.depth_motion import check_depth_motion
from wsm_data.clips.depth_gate import DepthSamples, check_samples, sample_depth
from wsm_data.clips.path_on_floor import PathOnFloor
from wsm_data.codecs.images import rgb_pixels
from wsm_data.geometry.camera import pixel_rays
from wsm_data.geometry.transform import transform_points
from wsm_data.maps.scene_map import SceneMap
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.verdict import Verdict

POINTS_PER_FRAME = 400
"""So many pixels of a sampled frame are held against the cloud at most."""

COLOUR_STEPS = 4
"""Over so many pairs of frames colour is compared at most: decoding colour is what a check costs."""

FARTHEST_M = 4.0
"""Points farther away are not held against the cloud: there the noise of depth cameras nears a voxel."""


def episode_verdicts(
    record: EpisodeRecord, frames: EpisodeFrames, scene_map: SceneMap, laid: PathOnFloor, dataset: DatasetManifest
) -> dict[str, Verdict]:
    """What every check that looks at images or at the map says, by its name, causes before their consequences.

    Poses that are another's explain all else; where a cloud is another's no path leads over its floor; and what a
    camera shows that drives through furniture does not move as it should.

    Raises:
        DataError: a frame does not decode.
    """
    samples = sample_depth(record, frames, dataset)
    return {
        "depth_agreement": check_samples(record, samples, dataset),
        "cloud_agreement": check_cloud(record, samples, scene_map, dataset),
        **laid.verdicts,
        "depth_motion": check_depth_motion(record, samples.depth_m, samples.steps, dataset.checks.max_depth_error),
        "colour_agreement": check_colour(record, frames, samples, dataset),
    }


def check_colour(
    record: EpisodeRecord, frames: EpisodeFrames, samples: DepthSamples, dataset: DatasetManifest
) -> Verdict:
    """Whether colour images move as poses and depth do; where they have another size than depth they tell nothing."""
    steps = samples.steps[:: max(1, math.ceil(len(samples.steps) / COLOUR_STEPS))]
    numbers = sorted({*chain(*steps)})
    rgb_u8 = {each: rgb_pixels(frames.rgb[each], f"{record.id.text}, colour frame {each}") for each in numbers}
    if any(rgb_u8[each].shape[:2] != samples.depth_m[each].shape for each in numbers):
        return Verdict(measured={"colour_steps": 0})
    limit = dataset.checks.min_colour_correlation
    return check_colour_agreement(record, rgb_u8, samples.depth_m, steps, limit)


def check_cloud(record: EpisodeRecord, samples: DepthSamples, scene_map: SceneMap, dataset: DatasetManifest) -> Verdict:
    """Whether depth images show the place that the cloud shows; a map that was fused from depth tells nothing."""
    if scene_map.origin != "cloud" or not samples.depth_m:
        return Verdict()
    points_m = np.concatenate([_world_points(record, number, samples) for number in samples.depth_m])
    bands = height_bands(points_m, record.floor_z_m, dataset.robot, record.camera_height_m)
    level = scene_map.level_at(record.floor_z_m)
    return check_cloud_agreement(bands, level, record.id.text, dataset.checks.min_cloud_share)


def _world_points(record: EpisodeRecord, number: int, samples: DepthSamples) -> Float64Array:
    """Points that a frame shows on a square lattice of its pixels, in the world, m; float64 [N, 3]."""
    depth_m = samples.depth_m[number]
    stride = int(np.ceil(np.sqrt(depth_m.size / POINTS_PER_FRAME)))
    lattice_m = depth_m[::stride, ::stride].astype(np.float64)
    points_m = pixel_rays(record.intrinsics)[::stride, ::stride] * lattice_m[..., None]
    return transform_points(record.T_world_camera[number], points_m[(lattice_m > 0) & (lattice_m < FARTHEST_M)])
