"""Is a trajectory sound? What its images, its poses and the map of its scene say of one another."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wsm_data.checks.cloud_agreement import check_cloud_agreement, height_bands
from wsm_data.checks.colour_agreement import check_colour_agreement
from wsm_data.checks.depth_motion import check_depth_motion
from wsm_data.checks.depth_pairs import lattice_rays
from wsm_data.checks.images.cloud_alignment import check_cloud_alignment
from wsm_data.checks.images.depth_values import check_depth_values
from wsm_data.checks.images.floor_level import check_floor_level
from wsm_data.checks.images.frame_order import check_frame_order
from wsm_data.checks.images.frames_repeat import check_frames_repeat
from wsm_data.checks.images.frames_shown import check_frames_shown
from wsm_data.checks.images.time_offset import check_time_offset
from wsm_data.clips.build import ClipVideos, read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.depth_gate import DepthSamples, check_samples, sample_depth
from wsm_data.clips.path_on_floor import PathOnFloor
from wsm_data.codecs.clip_video import VideoMemory
from wsm_data.geometry.transform import transform_points
from wsm_data.maps.scene_map import SceneMap
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.source.motion import CarriedBy
from wsm_data.schema.verdict import Verdict

POINTS_PER_FRAME = 400
"""So many pixels of a sampled frame are held against cloud and floor at most."""

FARTHEST_M = 4.0
"""Points farther away are not held against the cloud: there the noise of depth cameras nears a voxel."""


def check_episode(
    record: EpisodeRecord,
    frames: EpisodeFrames,
    scene_map: SceneMap,
    laid: PathOnFloor,
    dataset: DatasetManifest,
    config: ClipConfig,
    memory: VideoMemory | None = None,
) -> tuple[dict[str, Verdict], ClipVideos]:
    """What every check that looks at images or at the map says, by its name, and the videos that were looked at.

    Verdicts come in the order in which they explain one another. Images that are not measurements, or not in order,
    explain all that follows, and poses that are another's explain what does not fit the map; where a cloud is another's
    no path leads over its floor; and what a camera shows that drives through furniture does not move as it should.

    Images are decoded once: those of depth that are sampled are not decoded again for the videos.

    Raises:
        DataError: a frame does not decode, or a depth image holds no measurement.
    """
    samples = sample_depth(record, frames, dataset)
    videos = read_videos(record, _with_decoded(frames, samples), dataset, config, memory)
    where, checks = record.id.text, dataset.checks
    points_m = _camera_points(record, samples)
    verdicts = {
        "frames_repeat": check_frames_repeat(record, frames, dataset.depth, checks.max_repeated_share),
        "frames_shown": check_frames_shown(videos.rgb[: record.frame_count, ..., 1], where),
        "colour_order": check_frame_order(videos.rgb[: record.frame_count, ..., 1], "colour", where),
        **check_depth_values(list(samples.depth_m.values()), dataset.depth.metres_per_unit, checks, where),
        "depth_agreement": check_samples(record, samples, dataset),
        **_cloud_verdicts(record, points_m, scene_map, dataset),
        **laid.verdicts,
        "depth_motion": check_depth_motion(record, samples.depth_m, samples.steps, checks.max_depth_error),
        "colour_agreement": _check_colour(record, videos, samples, dataset),
    }
    if videos.depth is not None:
        depth = videos.depth[: record.frame_count, ..., 0]
        verdicts["depth_order"] = check_frame_order(depth, "depth", where)
        verdicts["time_offset"] = check_time_offset(record, depth, config.depth_range)
    if points_m and dataset.motion.carried_by == CarriedBy.ROBOT:  # a hand's floor was found in depth itself
        verdicts["floor_level"] = _check_floor(record, points_m)
    return verdicts, videos


def _with_decoded(frames: EpisodeFrames, samples: DepthSamples) -> EpisodeFrames:
    depth = list(frames.depth)
    for number, codes in samples.raw_u16.items():
        depth[number] = codes
    return replace(frames, depth=tuple(depth))


def _check_colour(
    record: EpisodeRecord, videos: ClipVideos, samples: DepthSamples, dataset: DatasetManifest
) -> Verdict:
    """Whether colour images move as poses and depth do, at the size in which they are encoded."""
    green, limit = videos.rgb[: record.frame_count, ..., 1], dataset.checks.min_colour_correlation
    return check_colour_agreement(record, green, samples.depth_m, samples.steps, limit)


def _cloud_verdicts(
    record: EpisodeRecord, points_m: Mapping[int, Float64Array], scene_map: SceneMap, dataset: DatasetManifest
) -> dict[str, Verdict]:
    """Whether depth images show the place that the cloud shows; a map that was fused from depth tells nothing."""
    if scene_map.origin != "cloud" or not points_m:
        return {}
    near_m = {number: points[points[:, 2] < FARTHEST_M] for number, points in points_m.items()}
    world_m = [transform_points(record.T_world_camera[number], points) for number, points in near_m.items()]
    bands = height_bands(np.concatenate(world_m), record.floor_z_m, dataset.robot, record.camera_height_m)
    level = scene_map.level_at(record.floor_z_m)
    where = record.id.text
    return {
        "cloud_agreement": check_cloud_agreement(bands, level, where, dataset.checks.min_cloud_share),
        "cloud_alignment": check_cloud_alignment(
            _held_by(near_m, record, dataset), record.T_world_camera, level, where
        ),
    }


def _held_by(
    points_m: Mapping[int, Float64Array], record: EpisodeRecord, dataset: DatasetManifest
) -> dict[int, Float64Array]:
    """The points at heights that clouds are kept for: from the floor to the top of the robot."""
    low_m, high_m = record.floor_z_m - dataset.robot.ground_clearance_m, record.floor_z_m + record.camera_height_m
    kept = {}
    for number, points in points_m.items():
        z_m = transform_points(record.T_world_camera[number], points)[:, 2]
        kept[number] = points[(z_m > low_m) & (z_m < high_m)]
    return kept


def _check_floor(record: EpisodeRecord, points_m: Mapping[int, Float64Array]) -> Verdict:
    drops, heights, slopes = [], [], []
    for number, points in points_m.items():
        T_world_camera = record.T_world_camera[number]
        drop_m = -points @ T_world_camera[2, :3]
        drops.append(drop_m)
        heights.append(np.full(len(points), T_world_camera[2, 3] - record.floor_z_m))
        slopes.append(drop_m / np.linalg.norm(points, axis=1))
    return check_floor_level(np.concatenate(drops), np.concatenate(heights), np.concatenate(slopes), record.id.text)


def _camera_points(record: EpisodeRecord, samples: DepthSamples) -> dict[int, Float64Array]:
    """Points that frames show on a square lattice of their pixels, by frame, in its camera, m; float64 [N, 3]."""
    points_m = {}
    for number, depth_m in samples.depth_m.items():
        stride = int(np.ceil(np.sqrt(depth_m.size / POINTS_PER_FRAME)))
        lattice_m = depth_m[::stride, ::stride].astype(np.float64)
        points_m[number] = (lattice_rays(record.intrinsics, stride) * lattice_m[..., None])[lattice_m > 0]
    return points_m
