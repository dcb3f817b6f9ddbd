"""From one trajectory and its map to one clip: the only place where videos, poses and geodesics meet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.checks.depth_measured import check_depth_measured
from wsm_data.checks.gate import require_kept
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.scene_view import SceneView
from wsm_data.codecs.base import ClipCodec
from wsm_data.codecs.clip_video import VideoMemory, depth_video, pad_frames, padded_length, rgb_video
from wsm_data.codecs.depth import depth_m_from_latent_video, valid_share
from wsm_data.codecs.quality import DEPTH_EDGES_M, CodecQuality, clip_quality, depth_error_by_range
from wsm_data.errors import Reason
from wsm_data.geometry.transform import invert, relative_to_first, transform_points, vectors_from_transforms
from wsm_data.maps.progress import field_to_mm
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames

QUALITY_STRIDE = 7
"""Of a clip whose codec quality is measured, every n-th frame is."""


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """What is known about a clip beside its arrays.

    Attributes:
        dataset: the source's conventions.
        map_digest: digest of the map level the trajectory lies on.
        map_from: `cloud`, `depth` or `path`.
        codec: name of the codec.
        codec_digest: digest of the codec.
    """

    dataset: DatasetManifest
    map_digest: str
    map_from: str
    codec: str
    codec_digest: str


@dataclass(frozen=True, kw_only=True)
class ClipVideos:
    """The padded videos of a trajectory, ready for a codec.

    Attributes:
        rgb: float32 [T, H, W, 3] in [-1, 1].
        depth: log-depth, one channel repeated; float32 [T, H, W, 3] in [-1, 1]. None where the source has no depth.
        depth_valid: pixels with a measurement; bool [T, H, W]. None likewise.
    """

    rgb: Float32Array
    depth: Float32Array | None
    depth_valid: BoolArray | None

    @property
    def all(self) -> list[Float32Array]:
        """What is encoded: the colour video, then that of depth where there is one."""
        return [self.rgb] if self.depth is None else [self.rgb, self.depth]


def read_videos(
    record: EpisodeRecord,
    frames: EpisodeFrames,
    dataset: DatasetManifest,
    config: ClipConfig,
    memory: VideoMemory | None = None,
) -> ClipVideos:
    """Decode, resize, normalise and pad the frames of a trajectory, into `memory` where it is given.

    Raises:
        DataError: a frame does not decode, or a depth image has no measurement.
    """
    where = record.id.text
    length = padded_length(record.frame_count, config.still_frames)
    size = config.width, config.height
    rgb = rgb_video(frames.rgb, *size, where, length, memory)
    if not record.has_depth:
        return ClipVideos(rgb=rgb, depth=None, depth_valid=None)
    depth, valid = depth_video(frames.depth, dataset.depth, config.depth_range, *size, where, length, memory)
    require_kept(check_depth_measured(valid[: record.frame_count], where))
    return ClipVideos(rgb=rgb, depth=depth, depth_valid=valid)


def build_clip(
    record: EpisodeRecord,
    view: SceneView,
    videos: ClipVideos,
    latents: Sequence[Float32Array],
    provenance: Provenance,
    config: ClipConfig,
) -> Clip:
    """Put a clip together.

    Args:
        record: the trajectory.
        view: it on its map.
        videos: its videos; only the validity of depth is taken from here.
        latents: codec latents of the videos, in their order, float32 [F, C, h, w].
        provenance: what cannot be seen in the data.
        config: what a clip holds.
    """
    length = len(videos.rgb)
    T_camera0_camera = relative_to_first(record.T_world_camera)
    poses = pad_frames(vectors_from_transforms(T_camera0_camera), length)
    return Clip(
        meta=_meta(record, view, length, provenance, config),
        rgb_latent=latents[0].astype(np.float16),
        depth_latent=None if videos.depth is None else latents[1].astype(np.float16),
        depth_valid=None if videos.depth_valid is None else valid_share(videos.depth_valid),
        poses=poses.astype(np.float32),
        occupancy=np.array(view.occupancy.cells),
        geodesic_mm=field_to_mm(view.geodesic_m),
        expert_distance=pad_frames(view.distance_m, length).astype(np.float32),
    )


def measure_quality(
    videos: ClipVideos, latents: Sequence[Float32Array], codec: ClipCodec, config: ClipConfig, frames: int
) -> CodecQuality:
    """Decode a clip's float16 latents again and compare every 7th of its `frames` own frames with what went in.

    A stride without a factor of the block's length meets all places in a block in turn; those repeated at the end, to
    fill the last block and to stand still, are left out.
    """
    sampled = slice(0, frames, QUALITY_STRIDE)
    decoded = [codec.decode(one.astype(np.float16).astype(np.float32))[sampled] for one in latents]
    true_m, depth_m, valid = np.empty(0, np.float32), np.empty(0, np.float32), np.empty(0, np.bool_)
    if videos.depth is not None and videos.depth_valid is not None:
        true_m = depth_m_from_latent_video(videos.depth[sampled], config.depth_range)
        depth_m = depth_m_from_latent_video(decoded[1], config.depth_range)
        valid = videos.depth_valid[sampled]
    errors = depth_error_by_range(true_m, depth_m, valid, DEPTH_EDGES_M)
    return clip_quality(videos.rgb[sampled], decoded[0], errors)


def _meta(record: EpisodeRecord, view: SceneView, length: int, provenance: Provenance, config: ClipConfig) -> ClipMeta:
    T_world_camera0 = record.T_world_camera[0]
    goal_world_m = record.goal_m
    goal_camera0_m = transform_points(invert(T_world_camera0), goal_world_m[None])[0]
    return ClipMeta(
        key=record.id.key,
        id=record.id,
        dataset=provenance.dataset.name,
        source_digest=record.content_digest,
        map_digest=provenance.map_digest,
        intrinsics=record.intrinsics.resized(config.width, config.height),
        T_world_camera0=tuple(tuple(row) for row in T_world_camera0.tolist()),
        goal_world_m=_point(goal_world_m),
        goal_camera0_m=_point(goal_camera0_m),
        map_origin_cell=view.occupancy.origin_cell,
        map_resolution_m=view.occupancy.resolution_m,
        map_from=provenance.map_from,
        freed_cells=view.freed_cells,
        goal_radius_m=config.goal_radius_m,
        robot_radius_m=provenance.dataset.robot.radius_m,
        camera_height_m=record.camera_height_m,
        camera_pitch_rad=record.camera_pitch_rad,
        frames=length,
        padded_frames=length - record.frame_count,
        codec=provenance.codec,
        codec_digest=provenance.codec_digest,
        depth_range=config.depth_range,
        notes=record.notes + (() if provenance.map_from == "cloud" else (Reason.CLOUD_MISSING.value,)),
    )


def _point(xyz_m: Float64Array) -> tuple[float, float, float]:
    x, y, z = xyz_m.tolist()
    return x, y, z
