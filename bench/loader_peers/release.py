"""The clips as a release, written by this project's own functions, and where their bytes stand in it."""

import shutil
from pathlib import Path

import numpy as np

from loader_peers.arrays import CLIPS, COLUMNS, FRAMES, ROWS, clip_arrays
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip import Clip
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.assemble import ReleaseFacts, finish_release
from wsm_data.shards.fragment import build_fragment, fragment_path, read_fragment_info, write_fragment
from wsm_data.shards.inventory import InventoryRow, UnitState
from wsm_data.shards.shard_layout import PlacedClip, lay_out_shards
from wsm_data.shards.writer import write_shard

SHARD_BYTES = 100 << 20
CODEC = CodecInfo(name="dct", digest="c0dec", channels=48, settings={"quality": [1, 2.5]})
WIDTH_PX, HEIGHT_PX = 16 * COLUMNS, 16 * ROWS
GOAL_M = (0.025, 0.025, 0.5)


def write_release(folder: Path) -> None:
    """A release of all clips in shards of 100 MB; the order of the clips in it is mixed, as in every release."""
    fragments = folder.with_name(f"{folder.name}.fragments")
    clips = [_store(fragments, number) for number in range(CLIPS)]
    layouts = lay_out_shards(clips, shard_bytes=SHARD_BYTES)
    facts = ReleaseFacts(
        name="bench",
        codec=CODEC,
        depth_range=DepthRange(),
        encoded_width_px=WIDTH_PX,
        encoded_height_px=HEIGHT_PX,
        licences={"bench": "CC0-1.0"},
    )
    finish_release(
        folder,
        facts,
        layouts=layouts,
        shards=[
            write_shard(folder / layout.name, layout, lambda key: fragment_path(fragments, key)) for layout in layouts
        ],
        read_info=lambda key: read_fragment_info(fragment_path(fragments, key)),
        inventory=[
            InventoryRow(unit=_id(number).text, container="bench", state=UnitState.CLIP, split="train")
            for number in range(CLIPS)
        ],
        refusals=(),
    )
    shutil.rmtree(fragments)


def _id(number: int) -> EpisodeId:
    return EpisodeId.parse(f"bench/home_{number % 10:04d}/{number:06d}")


def _store(fragments: Path, number: int) -> PlacedClip:
    path = write_fragment(fragments, build_fragment(_clip(number)))
    return PlacedClip(key=_id(number).key, split="train", size_bytes=path.stat().st_size)


def _clip(number: int) -> Clip:
    """The arrays of the clip, with the smallest map there is."""
    return Clip(
        meta=_meta(number),
        **clip_arrays(number),
        occupancy=np.zeros((1, 1), np.uint8),
        geodesic_mm=np.zeros((1, 1), np.uint16),
        expert_distance=np.zeros(FRAMES, np.float32),
    )


def _meta(number: int) -> ClipMeta:
    return ClipMeta(
        key=_id(number).key,
        id=_id(number),
        dataset="bench",
        source_digest=f"clip {number}",
        map_digest="map",
        intrinsics=Intrinsics(fx=300.0, fy=300.0, cx=159.5, cy=95.5, width=WIDTH_PX, height=HEIGHT_PX),
        T_world_camera0=tuple(tuple(float(x) for x in row) for row in np.eye(4)),
        goal_world_m=GOAL_M,
        goal_camera0_m=GOAL_M,
        map_origin_cell=(0, 0),
        map_resolution_m=0.05,
        map_from="cloud",
        freed_cells=0,
        goal_radius_m=0.2,
        robot_radius_m=0.25,
        camera_height_m=0.5,
        camera_pitch_rad=0.0,
        frames=FRAMES,
        padded_frames=0,
        codec=CODEC.name,
        codec_digest=CODEC.digest,
        depth_range=DepthRange(),
    )
