"""One clip as a recording for the viewer of rerun (https://rerun.io), to be looked at in three dimensions.

Written for rerun-sdk 0.41, whose encoded depth images are declared unstable. The package is optional, the extra `viz`,
and is imported when a recording is written.

Entities: `world` holds the map on the floor, the expert's path, the goal region and the moving `camera`, below whose
`pinhole` hang the decoded `rgb` (JPEG) and `depth` (PNG); `distance` holds the curves; `about` what `wsm inspect`
prints.
"""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

import cv2
import numpy as np

from wsm_data.clips.decoded import DecodedVideo, decode_video
from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_bytes
from wsm_data.files.digest import digest_json
from wsm_data.files.json_values import to_json
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.schema.arrays import Float64Array, Uint16Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import UNKNOWN
from wsm_data.view.clip.facts import clip_field_m, world_path_m
from wsm_data.view.clip.map_plot import GOAL_COLOUR, PATH_COLOUR, UNKNOWN_COLOUR, cell_picture
from wsm_data.view.clip.text import describe_clip
from wsm_data.view.drawing.jpeg import jpeg

TIMELINE = "frame"
_APPLICATION = "wsm"
_PINHOLE = "world/camera/pinhole"
_LINE_RADIUS_M = 0.015
_JPEG_QUALITY = 92
_DEPTH_PER_M = 500.0  # steps of 2 mm: what the codec gets wrong is more, and finer steps do not compress
_RING_CORNERS = 64
_RING_LIFT_M = 0.01  # a ring in the plane of the map would flicker through it


def write_rerun(clip: Clip, codec: VideoCodec, path: Path) -> None:
    """Write a recording of one clip. Padded still frames at its end are left out.

    The camera moves along the stored poses in the world (z up, m). Depth is in steps of 2 mm and 0, that is no
    measurement, in the latent cells of which less than half was measured; pictures are JPEGs, so a recording is two to
    three times as large as its clip. Intrinsics go in as they are: rerun projects depth with the
    centre of the first pixel at (0, 0), as this project does. What rerun stamps on a recording (the time it was written
    and ids drawn from it) makes the bytes differ from run to run; the content and the recording's id do not.

    Args:
        clip: what is shown.
        codec: the codec the clip was encoded with.
        path: where the recording goes, by custom `.rrd`; replaced atomically.

    Raises:
        ConfigError: rerun is not installed or switched off, or the clip was encoded with another codec.
    """
    rr = _import_rerun()
    decoded = decode_video(clip, codec, range(clip.meta.recorded_frames))
    with TemporaryDirectory() as folder, _strict(rr):
        saved = Path(folder) / "clip.rrd"
        stream = rr.RecordingStream(_APPLICATION, recording_id=digest_json(to_json(clip.meta)))
        _require_enabled(rr, stream)
        stream.save(saved)
        stream.send_recording_name(clip.meta.key)
        for entity, archetype in (_still_entities(rr, clip) | _image_formats(rr, clip)).items():
            stream.log(entity, archetype, static=True)
        for entity, (first_frame, columns) in (_poses_and_curves(rr, clip) | _images(rr, decoded)).items():
            times = rr.TimeColumn(TIMELINE, sequence=np.arange(first_frame, clip.meta.recorded_frames))
            stream.send_columns(entity, indexes=[times], columns=columns)
        stream.disconnect()
        write_bytes(path, saved.read_bytes())


def _still_entities(rr: ModuleType, clip: Clip) -> dict[str, Any]:
    """What does not change over time: entity path to archetype."""
    K = clip.intrinsics
    return {
        "about": rr.TextDocument(f"```\n{describe_clip(clip)}\n```", media_type="text/markdown"),
        "world": rr.ViewCoordinates.RIGHT_HAND_Z_UP,
        "world/map": _map_mesh(rr, clip),
        "world/expert_path": rr.LineStrips3D([world_path_m(clip)], colors=[_rgb(PATH_COLOUR)], radii=_LINE_RADIUS_M),
        "world/goal": rr.LineStrips3D([_goal_ring_m(clip)], colors=[_rgb(GOAL_COLOUR)], radii=_LINE_RADIUS_M),
        _PINHOLE: rr.Pinhole(image_from_camera=K.matrix, width=K.width, height=K.height),
    }


def _image_formats(rr: ModuleType, clip: Clip) -> dict[str, Any]:
    depth_range = (clip.meta.depth_range.min_m * _DEPTH_PER_M, clip.meta.depth_range.max_m * _DEPTH_PER_M)
    return {
        f"{_PINHOLE}/rgb": rr.EncodedImage.from_fields(media_type="image/jpeg"),
        f"{_PINHOLE}/depth": rr.EncodedDepthImage.from_fields(
            media_type="image/png", meter=_DEPTH_PER_M, depth_range=depth_range
        ),
    }


def _images(rr: ModuleType, decoded: DecodedVideo) -> dict[str, tuple[int, Any]]:
    """What the latents decode to: entity path to first frame and columns."""
    depth_m = np.where(decoded.measured, decoded.depth_m, np.float32(0))
    steps = np.round(np.clip(depth_m * _DEPTH_PER_M, 0, np.iinfo(np.uint16).max)).astype(np.uint16)
    return {
        f"{_PINHOLE}/rgb": (0, rr.EncodedImage.columns(blob=[jpeg(one, _JPEG_QUALITY) for one in decoded.rgb])),
        f"{_PINHOLE}/depth": (0, rr.EncodedDepthImage.columns(blob=[_png16(one) for one in steps])),
    }


def _png16(codes: Uint16Array) -> bytes:
    """PNG of a grey image of 16 bits, as small as it gets: what a recording is made of, and nobody waits for."""
    done, data = cv2.imencode(".png", codes, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    if not done:
        raise OSError("OpenCV cannot write depth as PNG")
    return data.tobytes()


def _poses_and_curves(rr: ModuleType, clip: Clip) -> dict[str, tuple[int, Any]]:
    """The camera and the numbers that change: entity path to first frame and columns.

    Progress of step l is D(l - 1) - D(l) and stands at frame l, so frame 0 has none.
    """
    frames = clip.meta.recorded_frames
    T_world_camera = clip.meta.T_world_camera0_matrix @ transforms_from_vectors(clip.poses[:frames].astype(np.float64))
    distance_m = clip.expert_distance[:frames].astype(np.float64)
    pose = rr.Transform3D.columns(translation=T_world_camera[:, :3, 3], mat3x3=T_world_camera[:, :3, :3])
    columns = {
        "world/camera": (0, pose),
        "distance/to_goal_m": (0, rr.Scalars.columns(scalars=distance_m)),
    }
    if frames > 1:
        columns["distance/progress_m"] = (1, rr.Scalars.columns(scalars=-np.diff(distance_m)))
    return columns


def _map_mesh(rr: ModuleType, clip: Clip) -> Any:
    """The crop of the map as one textured rectangle on the floor; row 0 of the picture is at the smallest y."""
    grid = clip.grid
    picture = cell_picture(grid, clip_field_m(clip))[..., :3].copy()
    picture[grid.cells == UNKNOWN] = _rgb(UNKNOWN_COLOUR)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    size_m = np.array(grid.cells.shape[::-1]) * grid.resolution_m
    return rr.Mesh3D(
        vertex_positions=_on_floor(clip, np.array(grid.origin_xy_m) + corners * size_m),
        triangle_indices=[[0, 1, 2], [0, 2, 3]],
        vertex_texcoords=corners,
        albedo_texture=picture,
    )


def _goal_ring_m(clip: Clip) -> Float64Array:
    """Outline of the goal region just above the floor, closed; float64 [N, 3]."""
    angle_rad = np.linspace(0.0, 2 * np.pi, _RING_CORNERS + 1)
    circle = np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    ring_m = _on_floor(clip, np.array(clip.meta.goal_world_m[:2]) + clip.meta.goal_radius_m * circle)
    return ring_m + np.array([0.0, 0.0, _RING_LIFT_M])


def _on_floor(clip: Clip, xy_m: Float64Array) -> Float64Array:
    """Places [N, 2] of the world on the floor, [N, 3], m; the floor lies one camera height below the first camera."""
    floor_z_m = clip.meta.T_world_camera0_matrix[2, 3] - clip.meta.camera_height_m
    return np.concatenate([xy_m, np.full((len(xy_m), 1), floor_z_m)], axis=1)


def _rgb(colour: str) -> tuple[int, ...]:
    """`#rrggbb` as three numbers of 0..255."""
    return tuple(bytes.fromhex(colour.removeprefix("#")))


def _import_rerun() -> ModuleType:
    try:
        return importlib.import_module("rerun")
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"a rerun recording needs the package {error.name}; install the extra: pip install -e '.[viz]' in a clone"
        ) from error


def _require_enabled(rr: ModuleType, stream: Any) -> None:
    if not rr.is_enabled(stream):
        raise ConfigError(
            "a rerun recording needs rerun to be switched on, found the environment variable RERUN to switch it off; "
            "unset it"
        )


@contextmanager
def _strict(rr: ModuleType) -> Iterator[None]:
    """Let rerun raise what it would else only warn of, and leave out of the recording."""
    before = rr.error_utils.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)
