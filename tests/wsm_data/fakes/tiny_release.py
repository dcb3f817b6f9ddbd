"""Small valid clips, and a release of six of them in three scenes."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip import Clip
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.assemble import ReleaseFacts, finish_release
from wsm_data.shards.fragment import build_fragment, fragment_path, read_fragment_info, write_fragment
from wsm_data.shards.inventory import InventoryRow, UnitState
from wsm_data.shards.manifest import ReleaseManifest
from wsm_data.shards.shard_layout import PlacedClip, lay_out_shards
from wsm_data.shards.writer import write_shard

CODEC = CodecInfo(name="dct", digest="c0dec", channels=48, settings={"quality": [1, 2.5]})
WIDTH_PX, HEIGHT_PX = 160, 96  # latents of 10 x 6 cells with a spatial ratio of 16
RESOLUTION_M = 0.05


def _meta(unit: str, shape: tuple[int, int, int], changes: Mapping[str, object]) -> ClipMeta:
    frames, rows, columns = shape
    goal = ((columns - 0.5) * RESOLUTION_M, (rows - 0.5) * RESOLUTION_M, 0.5)  # centre of the last cell
    values = {
        "key": EpisodeId.parse(unit).key,
        "id": EpisodeId.parse(unit),
        "dataset": "synthetic",
        "source_digest": f"source of {unit}",
        "map_digest": "map",
        "intrinsics": Intrinsics(fx=150.0, fy=149.5, cx=79.5, cy=47.25, width=WIDTH_PX, height=HEIGHT_PX),
        "T_world_camera0": tuple(tuple(float(x) for x in row) for row in np.eye(4)),
        "goal_world_m": goal,
        "goal_camera0_m": goal,
        "map_origin_cell": (0, 0),
        "map_resolution_m": RESOLUTION_M,
        "map_from": "cloud",
        "freed_cells": 0,
        "goal_radius_m": 0.2,
        "robot_radius_m": 0.25,
        "camera_height_m": 0.5,
        "camera_pitch_rad": 0.1,
        "frames": frames,
        "padded_frames": 0,
        "codec": CODEC.name,
        "codec_digest": CODEC.digest,
        "depth_range": DepthRange(),
        "notes": ("episode.length_mismatch",),
    }
    return ClipMeta(**(values | dict(changes)))


def build_clip(unit: str = "synth_d435i/home_0001/000003", *, latents: int = 3, **changes: object) -> Clip:
    """A clip of random content that depends on its unit alone; `changes` replace fields of its meta data."""
    rng = np.random.default_rng(list(unit.encode()))
    frames, rows, columns = 1 + 4 * (latents - 1), int(rng.integers(5, 20)), int(rng.integers(5, 20))
    quaternions = rng.normal(size=(frames, 4))
    quaternions *= np.sign(quaternions[:, :1]) / np.linalg.norm(quaternions, axis=1, keepdims=True)
    poses = np.concatenate([rng.normal(size=(frames, 3)), quaternions], axis=1).astype(np.float32)
    poses[0] = [0, 0, 0, 1, 0, 0, 0]
    occupancy = rng.choice(np.array([0, 1, 255], np.uint8), size=(rows, columns))
    occupancy[-1, -1] = 0
    geodesic_mm = rng.integers(0, 5000, size=(rows, columns), dtype=np.uint16)
    geodesic_mm[occupancy == 1] = 65535
    geodesic_mm[-1, -1] = 0
    shape = (latents, 48, HEIGHT_PX // 16, WIDTH_PX // 16)
    return Clip(
        meta=_meta(unit, (frames, rows, columns), changes),
        rgb_latent=rng.normal(size=shape).astype(np.float16),
        depth_latent=rng.normal(2.0, 3.0, size=shape).astype(np.float16),
        depth_valid=rng.integers(0, 256, size=(latents, *shape[2:]), dtype=np.uint8),
        poses=poses,
        occupancy=occupancy,
        geodesic_mm=geodesic_mm,
        expert_distance=np.linspace(3.0, 0.0, frames, dtype=np.float32),
    )


REFUSED = (
    {"unit": "synth_d435i/home_0002/000009", "source": "home_0002", "reason": "path.through_obstacle", "time": 17.5},
    {"unit": "synth_zed/home_0009.tar.gz", "source": "home_0009.tar.gz", "reason": "archive.truncated", "time": 3},
)
UNITS = tuple(
    f"synth_{camera}/home_{scene:04d}/{episode:06d}"
    for camera, scene, episode in [
        ("d435i", 1, 0),
        ("d435i", 1, 1),
        ("zed", 1, 0),
        ("d435i", 2, 0),
        ("zed", 2, 4),
        ("d435i", 3, 7),
        ("zed", 3, 1),
    ]
)
TEST_UNITS = UNITS[-2:]


def _inventory(clips: Sequence[Clip]) -> list[InventoryRow]:
    rows = [
        InventoryRow(
            unit=refusal["unit"], container=refusal["source"], state=UnitState.REFUSED, reason=refusal["reason"]
        )
        for refusal in REFUSED
    ]
    for clip in clips:
        unit = clip.meta.id.text
        split = "test" if unit in TEST_UNITS else "train"
        rows.append(
            InventoryRow(
                unit=unit, container="c", state=UnitState.CLIP, split=split, source_digest=clip.meta.source_digest
            )
        )
    return rows


def pack(
    folder: Path, clips: Sequence[Clip], *, shard_bytes: int, codec: CodecInfo = CODEC, **changes: object
) -> ReleaseManifest:
    """A release of these clips in `folder`; `changes` replace arguments of `finish_release`."""
    fragments = folder.with_name(f"{folder.name}.fragments")
    paths = {clip.meta.key: write_fragment(fragments, build_fragment(clip)) for clip in clips}
    placed = [
        PlacedClip(
            key=clip.meta.key,
            split="test" if clip.meta.id.text in TEST_UNITS else "train",
            size_bytes=paths[clip.meta.key].stat().st_size,
        )
        for clip in clips
    ]
    layouts = lay_out_shards(placed, shard_bytes=shard_bytes, seed=0)
    arguments = {
        "layouts": layouts,
        "shards": [write_shard(folder / layout.name, layout, lambda key: paths[key]) for layout in layouts],
        "read_info": lambda key: read_fragment_info(fragment_path(fragments, key)),
        "inventory": _inventory(clips),
        "refusals": REFUSED,
    }
    facts = ReleaseFacts(
        name="tiny",
        codec=codec,
        depth_range=DepthRange(),
        encoded_width_px=WIDTH_PX,
        encoded_height_px=HEIGHT_PX,
        fingerprints={"encode": "f1"},
        licences={"synthetic": "CC0-1.0"},
        codec_quality={"rgb_psnr_db": 25.5},
    )
    return finish_release(folder, facts, **(arguments | changes))


@pytest.fixture
def make_clip() -> Callable[..., Clip]:
    """`build_clip`."""
    return build_clip


@pytest.fixture(scope="session")
def clips() -> tuple[Clip, ...]:
    """Seven clips of three scenes under two cameras, of three to five latents."""
    return tuple(build_clip(unit, latents=3 + number % 3) for number, unit in enumerate(UNITS))


@pytest.fixture(scope="session")
def packed_tiny(tmp_path_factory: pytest.TempPathFactory, clips: tuple[Clip, ...]) -> tuple[Path, ReleaseManifest]:
    """The folder and manifest of the release that `tiny` copies."""
    folder = tmp_path_factory.mktemp("packed") / "release"
    return folder, pack(folder, clips, shard_bytes=200_000)


@pytest.fixture
def tiny(tmp_path: Path, clips: tuple[Clip, ...], packed_tiny: tuple[Path, ReleaseManifest]) -> SimpleNamespace:
    """A release of the seven clips in three shards: its folder, its manifest, and `pack` to make others."""
    original, manifest = packed_tiny
    folder = Path(shutil.copytree(original, tmp_path / "release"))
    return SimpleNamespace(folder=folder, manifest=manifest, clips=clips, pack=pack, codec=CODEC, refused=REFUSED)
