"""A room with box-shaped furniture, seen from a camera that drives through it: depth in closed form, no renderer.

Rays meet the inside of one box (the room) and the outside of some others, so every pixel's depth is known exactly. The
room is written as a source in the layouts and conventions of InternData-N1.
"""

import io
import json
import tarfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.geometry.camera import T_OPENGL_OPENCV, pixel_rays
from wsm_data.geometry.transform import invert
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.identity import EpisodeId

INTRINSICS = Intrinsics(fx=40.0, fy=40.0, cx=31.5, cy=23.5, width=64, height=48)
METRES_PER_UNIT = 1e-4
DATASET = DatasetManifest(
    name="box_rooms",
    licence="Apache-2.0",
    depth=DepthEncoding(metres_per_unit=METRES_PER_UNIT, invalid_codes=(0, 65535)),
)
MANIFEST_TOML = """\
name = "box_rooms"
licence = "Apache-2.0"
[depth]
metres_per_unit = 1e-4
invalid_codes = [0, 65535]
"""
RGB, DEPTH = "videos/chunk-000/observation.images.rgb", "videos/chunk-000/observation.images.depth"
_CLOUD_STEP_M = 0.05
_WALL_HEIGHT_M = 0.5  # of what the cloud shows of walls and furniture: as high as the robot


@dataclass(frozen=True, kw_only=True)
class Room:
    """The inside of a box, and boxes that stand in it; corners (x, y, z) in the world, m."""

    low: tuple[float, float, float] = (0.0, 0.0, 0.0)
    high: tuple[float, float, float] = (4.0, 3.0, 2.5)
    boxes: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A camera that drives through a room; positions over the floor [T, 2] and directions [T], m and rad."""

    xy_m: np.ndarray
    yaw_rad: np.ndarray
    room: Room = field(default_factory=Room)
    height_m: float = 0.5
    pitch_deg: float = 10.0

    @property
    def T_world_camera(self) -> np.ndarray:
        """OpenCV cameras, ahead along (cos yaw, sin yaw) and pitched down; float64 [T, 4, 4]."""
        pitch, up = np.deg2rad(self.pitch_deg), np.array([0.0, 0.0, 1.0])
        ahead = np.stack([np.cos(self.yaw_rad), np.sin(self.yaw_rad), np.zeros(len(self.yaw_rad))], axis=1)
        forward, right = np.cos(pitch) * ahead - np.sin(pitch) * up, np.cross(ahead, up)
        T = np.tile(np.eye(4), (len(ahead), 1, 1))
        T[:, :3, 0], T[:, :3, 1], T[:, :3, 2] = right, np.cross(forward, right), forward
        T[:, :2, 3], T[:, 2, 3] = self.xy_m, self.room.low[2] + self.height_m
        return T


PILLAR = ((1.8, 1.5, 0.0), (2.2, 1.9, 1.0))
HALL = Room(boxes=(PILLAR,))
UPSTAIRS = Room(low=(0.0, 0.0, 3.0), high=(4.0, 3.0, 5.5))


def along_x(
    room: Room = HALL, y_m: float = 0.8, frames: int = 7, step_m: float = 0.25, turn_rad: float = 0.03
) -> Drive:
    """Straight ahead from x = 0.6 m, looking a little further round in every frame."""
    x_m = room.low[0] + 0.6 + step_m * np.arange(frames)
    return Drive(room=room, xy_m=np.stack([x_m, np.full(frames, y_m)], axis=1), yaw_rad=turn_rad * np.arange(frames))


def depth_m(room: Room, T_world_camera: np.ndarray, intrinsics: Intrinsics = INTRINSICS) -> np.ndarray:
    """Exact depth along the optical axis of every pixel, from slabs; float64 [H, W], m."""
    origin = T_world_camera[:3, 3]
    rays = pixel_rays(intrinsics) @ T_world_camera[:3, :3].T
    with np.errstate(divide="ignore"):
        depth = _slabs(room.low, room.high, origin, rays)[1]
        for low, high in room.boxes:
            enter, leave = _slabs(low, high, origin, rays)
            depth = np.where((enter <= leave) & (enter > 0), np.minimum(depth, enter), depth)
    return depth


def _slabs(
    low: Sequence[float], high: Sequence[float], origin: np.ndarray, rays: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where rays enter and leave a box, in units of the ray."""
    a, b = (np.array(low) - origin) / rays, (np.array(high) - origin) / rays
    return np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)


def raw_depth(drive: Drive) -> np.ndarray:
    """Stored codes; uint16 [T, H, W]."""
    depths = np.stack([depth_m(drive.room, T) for T in drive.T_world_camera])
    return np.minimum(np.rint(depths / METRES_PER_UNIT), 65534).astype(np.uint16)


def colours(drive: Drive) -> np.ndarray:
    """Waves over the surfaces of the room, so that views differ; rgb_u8 [T, H, W, 3]."""
    frames = []
    for T in drive.T_world_camera:
        points = (pixel_rays(INTRINSICS) * depth_m(drive.room, T)[..., None]) @ T[:3, :3].T + T[:3, 3]
        frames.append(127.5 + 80 * np.sin(points * (2.0, 2.5, 3.0) + (0.0, 1.0, 2.0)))
    return np.stack(frames).astype(np.uint8)


def encoded(kind: str, image: np.ndarray) -> bytes:
    """An image file of a kind such as `.png`."""
    return cv2.imencode(kind, image)[1].tobytes()


def frames_of(drive: Drive) -> EpisodeFrames:
    """The files of a drive."""
    return EpisodeFrames(
        rgb=tuple(encoded(".jpg", image[..., ::-1]) for image in colours(drive)),
        depth=tuple(encoded(".png", image) for image in raw_depth(drive)),
    )


def record_of(drive: Drive, **changes: object) -> EpisodeRecord:
    """A drive as the reader hands it on."""
    frames = len(drive.xy_m)
    values = {
        "id": EpisodeId("box_d435i", "hall", "000000"),
        "container": "box_d435i/hall",
        "rgb_members": tuple(f"{frame}.jpg" for frame in range(frames)),
        "depth_members": tuple(f"{frame}.png" for frame in range(frames)),
        "T_world_camera": drive.T_world_camera,
        "intrinsics": INTRINSICS,
        "camera_height_m": drive.height_m,
        "camera_pitch_rad": float(np.deg2rad(drive.pitch_deg)),
        "frames_digest": "frames",
        "content_digest": "content",
    }
    return EpisodeRecord(**{**values, **changes})


def cloud_points(rooms: Sequence[Room]) -> tuple[np.ndarray, np.ndarray]:
    """A scene cloud of floors, walls and furniture: xyz float32 [N, 3] and whether it is an obstacle, bool [N]."""
    xyz, obstacle = [], []
    for room in rooms:
        floor = _grid(room.low, room.high, room.low[2])
        inside = [((floor[:, :2] > low[:2]) & (floor[:, :2] < high[:2])).all(axis=1) for low, high in room.boxes]
        floor = floor[~np.any([*inside, np.zeros(len(floor), bool)], axis=0)]
        walls = [_sides(room.low, room.high, outwards_m=0.01)] + [
            _sides((*low[:2], room.low[2]), high, outwards_m=-0.01) for low, high in room.boxes
        ]
        xyz += [floor, *walls]
        obstacle += [np.zeros(len(floor), bool), *(np.ones(len(wall), bool) for wall in walls)]
    return np.concatenate(xyz).astype(np.float32), np.concatenate(obstacle)


def _grid(low: Sequence[float], high: Sequence[float], z_m: float) -> np.ndarray:
    """A point in the middle of every cell of the floor, half a layer above it."""
    x, y = (np.arange(low[axis] + _CLOUD_STEP_M / 2, high[axis], _CLOUD_STEP_M) for axis in (0, 1))
    xx, yy = np.meshgrid(x, y)
    return np.stack([xx.ravel(), yy.ravel(), np.full(xx.size, z_m + 0.005)], axis=1)


def _sides(low: Sequence[float], high: Sequence[float], outwards_m: float) -> np.ndarray:
    """The four upright sides of a box, moved a little outwards so that it is plain in which cells they lie."""
    lower, upper = np.array(low) - outwards_m, np.array(high) + outwards_m
    x, y = (np.arange(lower[axis], upper[axis] + 1e-9, _CLOUD_STEP_M / 2) for axis in (0, 1))
    outline = [(one, edge) for edge in (lower[1], upper[1]) for one in x]
    outline += [(edge, one) for edge in (lower[0], upper[0]) for one in y]
    heights = low[2] + np.arange(_CLOUD_STEP_M / 2, _WALL_HEIGHT_M, _CLOUD_STEP_M)
    return np.concatenate([np.column_stack([outline, np.full(len(outline), z)]) for z in heights])


def ply_bytes(rooms: Sequence[Room]) -> bytes:
    """The cloud as a file; obstacles are dark blue."""
    xyz, obstacle = cloud_points(rooms)
    rows = np.zeros(len(xyz), [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    rows["xyz"], rows["rgb"] = xyz, np.where(obstacle[:, None], (0, 0, 128), (200, 200, 200))
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    lines += [f"property float {axis}" for axis in "xyz"] + [
        f"property uchar {one}" for one in ("red", "green", "blue")
    ]
    return ("\n".join(lines) + "\nend_header\n").encode() + rows.tobytes()


def table_bytes(drive: Drive) -> bytes:
    """The parquet table of a trajectory, with OpenGL poses."""
    rows = len(drive.xy_m)
    angle = np.deg2rad(90 - drive.pitch_deg)
    mount = np.eye(4)
    mount[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    mount[2, 3] = drive.height_m
    matrices = {
        "observation.camera_intrinsic": np.repeat(INTRINSICS.matrix[None], rows, axis=0),
        "observation.camera_extrinsic": np.repeat(mount[None], rows, axis=0),
        "action": drive.T_world_camera @ invert(T_OPENGL_OPENCV),
    }
    kind = pa.list_(pa.list_(pa.float32()))
    buffer = io.BytesIO()
    pq.write_table(pa.table({name: pa.array(value.tolist(), kind) for name, value in matrices.items()}), buffer)
    return buffer.getvalue()


def scene_files(drives: Mapping[int, Drive], cloud: bool = True) -> dict[str, bytes]:
    """The files of a scene folder, by relative name."""
    files = {}
    for number, drive in drives.items():
        files[f"data/chunk-000/episode_{number:06d}.parquet"] = table_bytes(drive)
        frames = frames_of(drive)
        for frame, (rgb, depth) in enumerate(zip(frames.rgb, frames.depth, strict=True)):
            files[f"{RGB}/episode_{number:06d}_{frame:03d}.jpg"] = rgb
            files[f"{DEPTH}/episode_{number:06d}_{frame:03d}.png"] = depth
    files["meta/episodes.jsonl"] = lengths_bytes({number: len(drive.xy_m) for number, drive in drives.items()})
    if cloud:
        rooms = list(dict.fromkeys(drive.room for drive in drives.values()))
        files["meta/pointcloud.ply"] = ply_bytes(rooms)
    return files


def lengths_bytes(lengths: Mapping[int, int]) -> bytes:
    """The content of meta/episodes.jsonl."""
    lines = [json.dumps({"episode_index": number, "length": length}) + "\n" for number, length in lengths.items()]
    return "".join(lines).encode()


def trajectory_files(drive: Drive, cloud: bool = True) -> dict[str, bytes]:
    """The files of a trajectory folder, by relative name."""
    return scene_files({0: drive}, cloud)


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files below a folder."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write the files of a scene as an archive, in which they lie below the scene's name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tarfile.open(path, "w:gz", compresslevel=1) as archive:
        for name in sorted(files):
            member = tarfile.TarInfo(f"{path.name.removesuffix('.tar.gz')}/{name}")
            member.size = len(files[name])
            archive.addfile(member, io.BytesIO(files[name]))


def moved(drive: Drive, **changes: object) -> Drive:
    """A drive with other fields."""
    return replace(drive, **changes)
