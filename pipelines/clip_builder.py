"""From one trajectory and its map to one clip: the only place where videos, poses and geodesics meet."""

from dataclasses import dataclass, field

import numpy as np
from wsm_data.checks.expert_path import check_expert_path
from wsm_data.checks.reachability import check_goal_reachable
from wsm_data.maps.crop import crop_around, free_swept_cells
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import SceneMap

from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.clip_video import depth_video, pad_frames, padded_length, rgb_video
from wsm_data.codecs.depth import depth_m_from_latent_video, valid_share
from wsm_data.codecs.quality import CodecQuality, clip_quality, depth_error_by_range
from wsm_data.geometry.transform import relative_to_first, vectors_from_transforms
from wsm_data.maps.footprint import clearance_m, traversable
from wsm_data.maps.geodesic import geodesic_field
from wsm_data.maps.progress import field_to_mm, sample_distance
from wsm_data.readers.frames import EpisodeFrames
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.occupancy import OCCUPIED, OccupancyGrid


@dataclass(frozen=True, kw_only=True)
class ClipConfig:
    """What a clip holds; where the paper is silent, the comment says so.

    Attributes:
        width: encoded width, px (table 4).
        height: encoded height, px (table 4).
        depth_range: metric range of the log-depth normalisation (app. A.1).
        still_frames: repeats of the last frame after the end, so that staying is learned; paper silent, K M = 16.
        goal_radius_m: radius r_g of the goal region, m (table 5).
        map_margin_m: the map crop reaches this far beyond path and goal, m; paper silent.
    """

    width: int = 320
    height: int = 192
    depth_range: DepthRange = field(default_factory=DepthRange)
    still_frames: int = 16
    goal_radius_m: float = 0.2
    map_margin_m: float = 2.0


@dataclass(frozen=True, kw_only=True)
class SceneView:
    """A trajectory on the map of its scene.

    Attributes:
        occupancy: crop of the map around path and goal.
        geodesic_m: geodesic distance to the goal region on the crop, m; float32 [Y, X].
        distance_m: geodesic distance of every camera position, m; float64 [T].
        freed_cells: unknown cells that the expert's footprint swept.
    """

    occupancy: OccupancyGrid
    geodesic_m: Float32Array
    distance_m: Float64Array
    freed_cells: int


@dataclass(frozen=True, kw_only=True)
class ClipVideos:
    """The padded videos of a trajectory, ready for a codec.

    Attributes:
        rgb: float32 [T, H, W, 3] in [-1, 1].
        depth: log-depth, one channel repeated; float32 [T, H, W, 3] in [-1, 1].
        depth_valid: pixels with a measurement; bool [T, H, W].
    """

    rgb: Float32Array
    depth: Float32Array
    depth_valid: BoolArray


def view_scene(record: EpisodeRecord, scene_map: SceneMap, dataset: DatasetManifest, config: ClipConfig) -> SceneView:
    """Cut the map for this robot, free what it swept, and measure distances to the goal on the whole floor.

    The field is computed before the crop: a detour may lead through rooms that the crop leaves out.

    Raises:
        DataError: the path leads through an obstacle, or the goal cannot be reached.
    """
    path_xy_m = record.path_xy_m
    whole = occupancy_for(scene_map, record.floor_z_m, record.camera_height_m, dataset.robot)
    whole = crop_around(whole, _corners_m(whole, path_xy_m), config.map_margin_m)
    whole, freed = free_swept_cells(whole, path_xy_m, dataset.robot.radius_m)
    _require(check_expert_path(clearance_m(whole, path_xy_m), record.id.text))
    goal_cell = whole.fractional_cells(path_xy_m[-1])
    geodesic_m = geodesic_field(
        traversable(whole, dataset.robot.radius_m),
        whole.cells == OCCUPIED,
        (float(goal_cell[0]), float(goal_cell[1])),
        whole.resolution_m,
        config.goal_radius_m,
    )
    distance_m = sample_distance(geodesic_m, whole, path_xy_m)
    _require(check_goal_reachable(distance_m, record.id.text))
    crop = crop_around(whole, path_xy_m, config.map_margin_m)
    return SceneView(
        occupancy=crop,
        geodesic_m=_same_crop(geodesic_m, whole, crop),
        distance_m=distance_m,
        freed_cells=freed,
    )


def read_videos(
    record: EpisodeRecord, frames: EpisodeFrames, dataset: DatasetManifest, config: ClipConfig
) -> ClipVideos:
    """Decode, resize, normalise and pad the frames of a trajectory.

    Raises:
        DataError: a frame does not decode, or depth and poses disagree.
    """
    where = record.id.text
    rgb = rgb_video(frames.rgb, config.width, config.height, where)
    depth, valid = depth_video(frames.depth, dataset.depth, config.depth_range, config.width, config.height, where)
    length = padded_length(record.frame_count, config.still_frames)
    return ClipVideos(
        rgb=pad_frames(rgb, length), depth=pad_frames(depth, length), depth_valid=pad_frames(valid, length)
    )


def build_clip(
    record: EpisodeRecord,
    view: SceneView,
    videos: ClipVideos,
    latents: tuple[Float32Array, Float32Array],
    provenance: "Provenance",
    config: ClipConfig,
) -> Clip:
    """Put a clip together.

    Args:
        record: the trajectory.
        view: it on its map.
        videos: its videos; only the validity of depth is taken from here.
        latents: codec latents of the colour and of the depth video, float32 [F, C, h, w].
        provenance: what cannot be seen in the data.
        config: what a clip holds.
    """
    length = len(videos.rgb)
    T_camera0_camera = relative_to_first(record.T_world_camera)
    poses = pad_frames(vectors_from_transforms(T_camera0_camera), length)
    return Clip(
        meta=_meta(record, view, length, provenance, config),
        rgb_latent=latents[0].astype(np.float16),
        depth_latent=latents[1].astype(np.float16),
        depth_valid=valid_share(videos.depth_valid),
        poses=poses.astype(np.float32),
        occupancy=np.array(view.occupancy.cells),
        geodesic_mm=field_to_mm(view.geodesic_m),
        expert_distance=pad_frames(view.distance_m, length).astype(np.float32),
    )


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """What is known about a clip beside its arrays.

    Attributes:
        dataset: the source's conventions.
        map_digest: digest of the scene's surface.
        map_from: `cloud` or `depth`.
        codec: name of the codec.
        codec_digest: digest of the codec.
    """

    dataset: DatasetManifest
    map_digest: str
    map_from: str
    codec: str
    codec_digest: str


def measure_quality(
    videos: ClipVideos, latents: tuple[Float32Array, Float32Array], codec: VideoCodec, config: ClipConfig
) -> CodecQuality:
    """Decode a clip's float16 latents again and compare with what went in: PSNR of colours, depth error by range."""
    rgb, depth = (codec.decode(one.astype(np.float16).astype(np.float32)) for one in latents)
    reference_m = depth_m_from_latent_video(videos.depth, config.depth_range)
    errors = depth_error_by_range(
        reference_m,
        depth_m_from_latent_video(depth, config.depth_range),
        videos.depth_valid,
        _quality_edges_m(config.depth_range),
    )
    return clip_quality(videos.rgb, rgb, errors)
