"""Small clips of a walled room, decodable by the dct codec, and a release of six of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wsm_data.access.release import Release, open_release
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import normalise_depth
from wsm_data.codecs.quality import CodecQuality, DepthErrors
from wsm_data.geometry.transform import invert
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip import UNREACHABLE_MM, Clip
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.assemble import ReleaseFacts, finish_release
from wsm_data.shards.fragment import build_fragment, fragment_path, read_fragment_info, write_fragment
from wsm_data.shards.inventory import InventoryRow, UnitState
from wsm_data.shards.shard_layout import PlacedClip, lay_out_shards
from wsm_data.shards.writer import write_shard

CODEC = DctCodec()
WIDTH_PX, HEIGHT_PX = 64, 32
RESOLUTION_M = 0.05
ORIGIN_CELL = (-10, 20)
CAMERA_HEIGHT_M = 0.5
FRAMES, PADDED = 13, 4
START_CELL, GOAL_CELL = np.array([8.0, 12.0]), np.array([50.0, 20.0])  # (column, row)

# Camera x right, y down, z forward, looking along world +x: columns are the camera's axes in the world.
LOOKING_ALONG_X = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def room_cells() -> np.ndarray:
    """40 rows of 60 columns: walls of one cell around, a pillar, an unknown corner."""
    cells = np.zeros((40, 60), np.uint8)
    cells[[0, -1]] = 1
    cells[:, [0, -1]] = 1
    cells[25:30, 20:30] = 1
    cells[30:39, 50:59] = 255
    return cells


def room_field_mm(cells: np.ndarray) -> np.ndarray:
    """Straight distance to the goal region of radius 0.2 m, mm; nothing stands between. Walls and unknown have none."""
    rows, columns = np.mgrid[: cells.shape[0], : cells.shape[1]]
    distance_m = np.hypot(columns - GOAL_CELL[0], rows - GOAL_CELL[1]) * RESOLUTION_M - 0.2
    return np.where(cells == 0, np.round(np.maximum(distance_m, 0) * 1000), UNREACHABLE_MM).astype(np.uint16)


def build_clip(unit: str = "synth_d435i/home_0001/000003", **changes: object) -> Clip:
    """A clip that goes straight from start to goal; `changes` replace arrays of the clip or fields of its meta data."""
    rng = np.random.default_rng(list(unit.encode(errors="surrogatepass")))
    moving = FRAMES - PADDED
    cells = np.linspace(START_CELL, GOAL_CELL, moving)
    path_xy_m = (cells + np.array(ORIGIN_CELL) + 0.5) * RESOLUTION_M
    path_m = np.concatenate([path_xy_m, np.full((moving, 1), CAMERA_HEIGHT_M)], axis=1)
    path_m = np.concatenate([path_m, np.repeat(path_m[-1:], PADDED, axis=0)])
    T_world_camera0 = np.eye(4)
    T_world_camera0[:3, :3], T_world_camera0[:3, 3] = LOOKING_ALONG_X, path_m[0]
    poses = np.zeros((FRAMES, 7), np.float32)
    poses[:, :3], poses[:, 3] = (path_m - path_m[0]) @ LOOKING_ALONG_X, 1
    distance_m = np.linalg.norm(path_m - path_m[-1], axis=1) - 0.2
    depth_m = np.broadcast_to(np.linspace(0.5, 4.5, WIDTH_PX), (FRAMES, HEIGHT_PX, WIDTH_PX))
    colours = rng.uniform(-0.9, 0.9, (2, 3)).astype(np.float32)
    ramp = np.linspace(0, 1, WIDTH_PX, dtype=np.float32)[:, None]
    rgb = np.broadcast_to(colours[0] * ramp + colours[1] * (1 - ramp), (FRAMES, HEIGHT_PX, WIDTH_PX, 3))
    depth_video = np.repeat(normalise_depth(depth_m, DepthRange())[..., None], 3, axis=-1)
    depth_valid = np.full((4, 2, 4), 255, np.uint8)
    depth_valid[1, 0, 0] = 0
    occupancy = room_cells()
    arrays = {
        "rgb_latent": CODEC.encode(np.ascontiguousarray(rgb)).astype(np.float16),
        "depth_latent": CODEC.encode(depth_video).astype(np.float16),
        "depth_valid": depth_valid,
        "poses": poses,
        "occupancy": occupancy,
        "geodesic_mm": room_field_mm(occupancy),
        "expert_distance": np.maximum(distance_m, 0).astype(np.float32),
    }
    goal_camera0_m = (invert(T_world_camera0) @ np.append(path_m[-1], 1))[:3]
    meta = {
        "key": EpisodeId.parse(unit).key,
        "id": EpisodeId.parse(unit),
        "dataset": "synthetic",
        "source_digest": f"source of {unit}",
        "map_digest": "map",
        "intrinsics": Intrinsics(fx=60.0, fy=60.0, cx=31.5, cy=15.5, width=WIDTH_PX, height=HEIGHT_PX),
        "T_world_camera0": tuple(tuple(row) for row in T_world_camera0.tolist()),
        "goal_world_m": tuple(path_m[-1].tolist()),
        "goal_camera0_m": tuple(goal_camera0_m.tolist()),
        "map_origin_cell": ORIGIN_CELL,
        "map_resolution_m": RESOLUTION_M,
        "map_from": "cloud",
        "freed_cells": 0,
        "goal_radius_m": 0.2,
        "robot_radius_m": 0.25,
        "camera_height_m": CAMERA_HEIGHT_M,
        "camera_pitch_rad": 0.1,
        "frames": FRAMES,
        "padded_frames": PADDED,
        "codec": CODEC.describe().name,
        "codec_digest": CODEC.describe().digest,
        "depth_range": DepthRange(),
    }
    arrays |= {name: value for name, value in changes.items() if name in arrays}
    meta |= {name: value for name, value in changes.items() if name not in arrays}
    return Clip(meta=ClipMeta(**meta), **arrays)


HOSTILE_SCENE = "home<script>alert(1)<script>$x$"
UNITS = {
    "synth_d435i/home_0001/000000": "train",
    "synth_zed/home_0001/000000": "test",
    "synth_d435i/home_0002/000001": "train",
    f"synth_d435i/{HOSTILE_SCENE}/000002": "train",
    "synth_zed/home_0003/000004": "test",
    "synth_zed/home_0001/000005": "test",
}
REFUSALS = (
    {"unit": "synth_zed/home_0009", "reason": "archive.truncated", "stage": "index", "message": "ends <b>early</b>"},
    {"unit": "synth_d435i/home_0002/000009", "reason": "path.through_obstacle", "stage": "encode", "message": "later"},
    {"unit": "synth_d435i/home_0002/000007", "reason": "path.through_obstacle", "stage": "encode", "message": "first"},
)
QUALITY = CodecQuality(
    clips=6,
    squared_error_sum=12.0,  # of 1200 values in [-1, 1]: mean 0.01, so 10 log10(4 / 0.01) = 26.02 dB
    values=1200,
    depth=DepthErrors(edges_m=(0.2, 1.0, 5.0), error_sum_m=(1.0, 30.0), counts=(100, 200), pixels=400),
)


def build_release(folder: Path, units: Mapping[str, str], refusals=REFUSALS, **facts: object) -> Release:
    """A release of clips with the splits given, opened."""
    fragments = [build_fragment(build_clip(unit, notes=("cloud.missing",))) for unit in units]
    for fragment in fragments:
        write_fragment(folder / "fragments", fragment)
    placed = [
        PlacedClip(key=fragment.info.key, split=split, size_bytes=fragment.info.size_bytes)
        for fragment, split in zip(fragments, units.values(), strict=True)
    ]

    def place(key: str) -> Path:
        return fragment_path(folder / "fragments", key)

    layouts = lay_out_shards(placed)
    stated = {"name": "small <i>homes</i>", "licences": {"synthetic": "CC0-1.0"}, "fingerprints": {"encode": "ab12"}}
    finish_release(
        folder / "release",
        ReleaseFacts(
            codec=CODEC.describe(),
            depth_range=DepthRange(),
            encoded_width_px=WIDTH_PX,
            encoded_height_px=HEIGHT_PX,
            **(stated | facts),
        ),
        layouts=layouts,
        shards=[write_shard(folder / "release" / layout.name, layout, place) for layout in layouts],
        read_info=lambda key: read_fragment_info(place(key)),
        inventory=[
            *(
                InventoryRow(unit=unit, container="c", state=UnitState.CLIP, split=split)
                for unit, split in units.items()
            ),
            *(
                InventoryRow(unit=line["unit"], container="c", state=UnitState.REFUSED, reason=line["reason"])
                for line in refusals
            ),
        ],
        refusals=refusals,
    )
    return open_release(folder / "release")
