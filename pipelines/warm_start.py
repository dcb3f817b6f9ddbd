"""Imported once by the process that workers are forked from: what each of them would otherwise do for itself first.

Loads the stages that read frames, with their libraries, and has the compiled kernels of a trajectory's way through
`wsm index` and `wsm encode` loaded from their cache (or compiled, where there is none yet) by using each of them on a
room of a few cells. What is missing here is loaded where it is needed: this is about time alone.
"""

import gc

import cv2
import numpy as np
import simplejpeg

import pipelines.cli
import pipelines.stages.encode
import pipelines.stages.index
import pipelines.stages.map  # noqa: F401 - only to be loaded, as the three above
from wsm_data.checks.depth_pairs import depth_pair, relative_errors
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_view import view_scene
from wsm_data.codecs.clip_video import depth_video, rgb_video
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import valid_share
from wsm_data.maps.near_surface import near_surface
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_cloud, voxels_from_depth
from wsm_data.readers.ply import read_point_cloud
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding, DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

_SIDE_PX = 32
_FRAMES = 5
_DATASET = DatasetManifest(
    name="warm_start", licence="", depth=DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
)


def _use_frame_kernels() -> None:
    """Decode, resize, encode and compare a video of grey."""
    jpeg = simplejpeg.encode_jpeg(np.full((_SIDE_PX, _SIDE_PX, 3), 128, np.uint8))
    png = cv2.imencode(".png", np.full((_SIDE_PX, _SIDE_PX), 20_000, np.uint16))[1].tobytes()
    size = _SIDE_PX, _SIDE_PX
    colour = rgb_video([jpeg], *size, "warm start")
    depth, valid = depth_video([png], _DATASET.depth, DepthRange(), *size, "warm start")
    valid_share(valid)
    DctCodec().encode_many([colour, depth])
    depth_m = {0: np.full(size, 2.0, np.float32)}
    intrinsics = _intrinsics()
    relative_errors(depth_pair(0, 0, depth_m, intrinsics, _SIDE_PX**2), np.eye(4), intrinsics)


def _use_map_kernels() -> None:
    """Put an obstacle on a floor, and drive past it."""
    voxels_from_depth([np.zeros((1, 3))])
    voxels = voxels_from_cloud(read_point_cloud(_cloud_file()), _DATASET.cloud)
    scene_map = build_scene_map(voxels, (0.0,), _DATASET.robot, max_height_m=1.0)
    config = ClipConfig()
    view_scene(_record(), lay_path(_record(), scene_map, _DATASET, config), _DATASET, config)
    near_surface(scene_map.levels[0], np.zeros((1, 3)))


def _cloud_file() -> bytes:
    """A floor of 3 m x 3 m with an obstacle in a corner, as a PLY file."""
    names = ("x", "y", "z"), ("red", "green", "blue")
    points = np.zeros(3601, [*((name, "<f4") for name in names[0]), *((name, "u1") for name in names[1])])
    points["x"][:-1], points["y"][:-1] = (axis.ravel() * 0.05 + 0.025 for axis in np.indices((60, 60)))
    points["z"][-1], points["blue"][-1] = 0.4, 128
    properties = [*(f"property float {name}" for name in names[0]), *(f"property uchar {name}" for name in names[1])]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}", *properties, "end_header", ""]
    return "\n".join(lines).encode() + points.tobytes()


def _record() -> EpisodeRecord:
    T_world_camera = np.tile(np.eye(4), (_FRAMES, 1, 1))
    T_world_camera[:, :3, 3] = np.linspace((1.0, 1.0, 0.5), (2.0, 2.0, 0.5), _FRAMES)
    members = tuple(str(number) for number in range(_FRAMES))
    return EpisodeRecord(
        id=EpisodeId("warm", "start", "000000"),
        container="warm/start",
        rgb_members=members,
        depth_members=members,
        T_world_camera=T_world_camera,
        intrinsics=_intrinsics(),
        camera_height_m=0.5,
        camera_pitch_rad=0.0,
        frames_digest="",
        content_digest="",
    )


def _intrinsics() -> Intrinsics:
    return Intrinsics(fx=20.0, fy=20.0, cx=15.5, cy=15.5, width=_SIDE_PX, height=_SIDE_PX)


_use_frame_kernels()
_use_map_kernels()
gc.collect()
gc.freeze()  # a worker's collector passes over what was loaded here, and its pages stay shared with the other workers
