"""What one camera records in one home: planned episodes, and their frames as they are stored."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.synth.config import CAMERAS, SynthConfig
from wsm_data.synth.drive.expert import Episode, plan_episode
from wsm_data.synth.drive.occupancy import SceneColumns, scene_columns
from wsm_data.synth.home.home import Home, make_home
from wsm_data.synth.render.render import make_buffers, render
from wsm_data.synth.writers.cloud import scene_cloud
from wsm_data.synth.writers.images import add_noise, depth_codes, encode_jpeg, encode_png_16, noise_tile

_EPISODE_STREAM, _NOISE_STREAM = 1, 2


@dataclass(frozen=True, kw_only=True)
class SceneRecording:
    """Everything about a scene and camera but the frames.

    Attributes:
        home: the scene.
        cloud: its points.
        episodes: planned recordings.
        intrinsics: the camera, with float32 numbers as they are stored.
        scene_index: number of the scene.
        camera: name of the camera.
    """

    home: Home
    cloud: PointCloud
    episodes: tuple[Episode, ...]
    intrinsics: Intrinsics
    scene_index: int
    camera: str


def plan_recording(scene_index: int, camera: str, config: SynthConfig) -> SceneRecording:
    """Build the home and plan all episodes of one camera in it."""
    home, columns = _scene(config.seed, scene_index, config.ground_clearance_m)
    episodes = tuple(
        plan_episode(home, columns, _stream(config, scene_index, camera, _EPISODE_STREAM, number), config)
        for number in range(config.trajectories)
    )
    return SceneRecording(
        home=home,
        cloud=scene_cloud(home, config),
        episodes=episodes,
        intrinsics=_as_stored(config.intrinsics(camera)),
        scene_index=scene_index,
        camera=camera,
    )


@lru_cache(maxsize=1)
def _scene(seed: int, scene_index: int, ground_clearance_m: float) -> tuple[Home, SceneColumns]:
    """The home and what is above each of its places; kept for the scene's next camera, since they take longest."""
    home = make_home(seed, scene_index, ground_clearance_m)
    return home, scene_columns(home)


def record_frames(recording: SceneRecording, number: int, config: SynthConfig) -> Iterator[tuple[bytes, bytes]]:
    """The frames of episode `number` in time order, as a JPEG and a 16-bit PNG of depth each."""
    intrinsics = recording.intrinsics
    rng = _stream(config, recording.scene_index, recording.camera, _NOISE_STREAM, number)
    tile = noise_tile(rng, intrinsics.height, intrinsics.width, config.noise_sigma)
    buffers = make_buffers(recording.home.mesh, intrinsics)
    for T_world_camera in recording.episodes[number].T_world_camera:
        rgb_u8, depth_m = render(recording.home.mesh, T_world_camera, intrinsics, buffers)
        picture = add_noise(rgb_u8, tile, rng) if config.noise_sigma > 0 else rgb_u8
        codes = depth_codes(depth_m, config.metres_per_depth_unit)
        yield encode_jpeg(picture, config.jpeg_quality), encode_png_16(codes, config.png_level)


def _stream(config: SynthConfig, scene_index: int, camera: str, purpose: int, number: int) -> np.random.Generator:
    """Randomness of one purpose in one episode: the same however many others there are."""
    return np.random.default_rng([config.seed, scene_index, list(CAMERAS).index(camera), purpose, number])


def _as_stored(intrinsics: Intrinsics) -> Intrinsics:
    """Intrinsics as float32 holds them: what is rendered with is what is written down."""
    fx, fy, cx, cy = (float(np.float32(v)) for v in (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy))
    return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=intrinsics.width, height=intrinsics.height)
