"""Releases without shards, of any number of clips: the index as `wsm pack` writes it, and the manifest of it."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from wsm_data.files.digest import sha256_file
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.depth import DepthRange
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import write_index
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo, manifest_bytes
from wsm_data.shards.members import MEMBER_NAMES, META, STORED_DTYPES, shape_of
from wsm_data.shards.names import INDEX_NAME, MANIFEST_NAME, shard_name
from wsm_data.shards.shard_layout import DEFAULT_SHARD_BYTES
from wsm_data.shards.statistics import LatentStatistics

GROUPS = ("gibson_d435i", "gibson_zed", "hssd_d435i", "hssd_zed", "matterport_d435i", "matterport_zed")
EPISODES_PER_SCENE = 300
TEST_SHARE = 0.05
DIGEST_DIGITS = 64
CODEC = CodecInfo(name="dct", digest="c" * DIGEST_DIGITS)


def generate_release(folder: Path, clips: int) -> None:
    """A release of so many clips, without its shards."""
    rng = np.random.default_rng(clips)
    axes = _axes(rng, clips)
    offsets, sizes, clip_sizes = _layout(rng, axes, clips)
    shards, shard_of_clip, clip_offsets, position = _shards(clip_sizes)
    columns = _names(rng, clips)
    columns |= {"split": _repeated(shard_of_clip >= round(len(shards) * TEST_SHARE), ("test", "train"))}
    columns |= {"shard": _repeated(shard_of_clip, tuple(shard.name for shard in shards))}
    columns |= {"position": position, "padded_frames": rng.integers(0, 4, clips)}
    columns |= {"latents": axes["F"], "channels": axes["C"], "latent_height": axes["h"], "latent_width": axes["w"]}
    columns |= {"frames": axes["T"], "map_height": axes["Y"], "map_width": axes["X"]}
    columns |= {"clip_offset": clip_offsets, "clip_size": clip_sizes}
    columns |= {f"{name}_offset": clip_offsets + offsets.pop(name) for name in MEMBER_NAMES}
    columns |= {f"{name}_size": sizes[name] for name in MEMBER_NAMES}
    columns |= {f"{name}_checksum": _words(rng, clips) for name in MEMBER_NAMES}
    arrays = [pa.array(columns.pop(field.name), field.type) for field in SCHEMA]
    folder.mkdir(parents=True)
    write_index(folder / INDEX_NAME, pa.Table.from_arrays(arrays, schema=SCHEMA))
    frames, latents = int(axes["T"].sum()), int(axes["F"].sum())
    (folder / MANIFEST_NAME).write_bytes(manifest_bytes(_manifest(folder, shards, clips, frames, latents)))


def _axes(rng: np.random.Generator, clips: int) -> dict[str, np.ndarray]:
    """Latents of 320 x 192 px; about 43 of them, which with the maps makes 2 MB."""
    latents = rng.integers(20, 67, clips)
    fixed = {axis: np.full(clips, length) for axis, length in (("C", 48), ("h", 12), ("w", 20))}
    sides = {axis: rng.integers(100, 300, clips) for axis in "YX"}
    return {"F": latents, **fixed, "T": 4 * latents - 3, **sides}


def _layout(
    rng: np.random.Generator, axes: dict[str, np.ndarray], clips: int
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]:
    """Offsets within the clip and sizes of the members, and sizes of the clips, as `lay_out` places them."""
    offsets, sizes, end = {}, {}, np.zeros(clips, np.int64)
    for name in MEMBER_NAMES:
        npy = 0 if name == META else 128
        if name == META:
            sizes[name] = rng.integers(1800, 2000, clips)
        else:
            sizes[name] = np.prod(np.broadcast_arrays(*shape_of(name, axes)), axis=0) * STORED_DTYPES[name].itemsize
        offsets[name] = end + 512 + npy
        end = end + 512 + -(-(npy + sizes[name]) // 512) * 512
    return offsets, sizes, end


def _shards(clip_sizes: np.ndarray) -> tuple[list[ShardInfo], np.ndarray, np.ndarray, np.ndarray]:
    """Shards of `DEFAULT_SHARD_BYTES`, the shard of each clip, where the clip starts in it, and its number there."""
    ends = np.cumsum(clip_sizes)
    shard_of_clip = (ends - clip_sizes) // DEFAULT_SHARD_BYTES
    shard_of_clip = np.unique(shard_of_clip, return_inverse=True)[1]
    firsts = np.flatnonzero(np.diff(shard_of_clip, prepend=-1))
    counts = np.diff(np.append(firsts, len(clip_sizes)))
    clip_offsets = ends - clip_sizes - np.repeat(ends[firsts] - clip_sizes[firsts], counts)
    position = np.arange(len(clip_sizes)) - np.repeat(firsts, counts)
    test = round(len(counts) * TEST_SHARE)
    shards = []
    for number, (first, count) in enumerate(zip(firsts.tolist(), counts.tolist(), strict=True)):
        split = "test" if number < test else "train"
        name = shard_name(split, number if number < test else number - test)
        size = int(clip_sizes[first : first + count].sum()) + 1024
        shards.append(ShardInfo(name=name, split=split, clips=count, bytes=size, sha256=f"{number:064x}"))
    return shards, shard_of_clip, clip_offsets, position


def _names(rng: np.random.Generator, clips: int) -> dict[str, pa.Array]:
    """Text columns; the clips of all scenes mixed, as the packer mixes them."""
    number = rng.permutation(clips)
    scenes = -(-clips // EPISODES_PER_SCENE)
    scene = number // EPISODES_PER_SCENE
    group = scene % len(GROUPS)
    scene_names = [f"scene_{name:06d}" for name in range(scenes)]
    episode = pa.array(np.char.zfill((number % EPISODES_PER_SCENE).astype("U6"), 6))
    columns: dict[str, pa.Array] = {"episode": episode, "group": _repeated(group, GROUPS)}
    columns["scene"] = _repeated(scene, scene_names)
    columns["physical_scene"] = _repeated(
        scene, [f"{GROUPS[name % len(GROUPS)].rpartition('_')[0]}/{scene_names[name]}" for name in range(scenes)]
    )
    columns["camera"] = _repeated(group % 2, ("d435i", "zed"))
    columns["dataset"] = _repeated(group * 0, ("interndata_n1",))
    columns["codec_digest"] = _repeated(group * 0, (CODEC.digest,))
    prefix = pa.array([f"{GROUPS[name % len(GROUPS)]}/{scene_names[name]}/" for name in range(scenes)])
    columns["key"] = pc.binary_join_element_wise(prefix.take(pa.array(scene)), episode, "")
    columns["source_digest"] = _hexadecimal(rng, clips)
    return columns


def _repeated(codes: np.ndarray, values: object) -> pa.DictionaryArray:
    return pa.DictionaryArray.from_arrays(pa.array(codes.astype(np.int32)), pa.array(values, pa.string()))


def _words(rng: np.random.Generator, clips: int) -> np.ndarray:
    return rng.integers(0, 1 << 64, clips, dtype=np.uint64)


def _hexadecimal(rng: np.random.Generator, clips: int) -> pa.StringArray:
    letters = np.frombuffer(b"0123456789abcdef", np.uint8)[rng.integers(0, 16, clips * DIGEST_DIGITS, dtype=np.uint8)]
    offsets = np.arange(clips + 1, dtype=np.int32) * DIGEST_DIGITS
    return pa.StringArray.from_buffers(clips, pa.py_buffer(offsets), pa.py_buffer(letters))


def _manifest(folder: Path, shards: list[ShardInfo], clips: int, frames: int, latents: int) -> ReleaseManifest:
    statistics = LatentStatistics(count=1, mean=(0.0,) * CODEC.channels, std=(1.0,) * CODEC.channels)
    by_split = {split: sum(shard.clips for shard in shards if shard.split == split) for split in ("test", "train")}
    return ReleaseManifest(
        name="generated",
        clips=clips,
        frames=frames,
        latents=latents,
        clips_by_split=by_split,
        clips_by_group={},
        shards=tuple(shards),
        index_sha256=sha256_file(folder / INDEX_NAME),
        inventory_sha256="",
        quarantine_sha256="",
        codec=CODEC,
        rgb_statistics=statistics,
        depth_statistics=statistics,
        depth_range=DepthRange(),
        encoded_width_px=320,
        encoded_height_px=192,
        fingerprints={},
        licences={},
        drops={},
        pending=0,
    )
