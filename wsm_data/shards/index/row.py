"""One row of index.parquet: the columns, and the value they stand for.

Numbers that decide where to read are flat integer columns, so that a loader opens ten million rows by reading only the
columns it needs. Shapes are not repeated per member: a row holds the lengths of the axes, and the file's metadata says,
under `wsm.members`, which dtype and which of these columns make up each member. A member that a clip does not have has
offset, size and checksum 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import pyarrow as pa

from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.clip import DEPTH_MEMBERS, MEMBERS, META_MEMBER
from wsm_data.shards.fragment import FragmentInfo
from wsm_data.shards.members import MEMBER_NAMES, META, STORED_DTYPES, Member, lay_out
from wsm_data.shards.names import INDEX_NAME

INDEX_VERSION = "1"
AXIS_COLUMNS: Mapping[str, str] = MappingProxyType(
    {
        "F": "latents",
        "C": "channels",
        "h": "latent_height",
        "w": "latent_width",
        "T": "frames",
        "Y": "map_height",
        "X": "map_width",
    }
)
"""Column that holds the length of each axis."""

REPEATED_COLUMNS = ("split", "shard", "group", "scene", "physical_scene", "camera", "dataset", "codec_digest")
UNIQUE_COLUMNS = ("key", "episode", "source_digest")
COUNT_COLUMNS = ("position", "padded_frames", *AXIS_COLUMNS.values())
PLACE_COLUMNS = (
    "clip_offset",
    "clip_size",
    *(f"{name}_{what}" for name in MEMBER_NAMES for what in ("offset", "size")),
)
CHECKSUM_COLUMNS = tuple(f"{name}_checksum" for name in MEMBER_NAMES)
_METADATA = {
    "wsm.index_version": INDEX_VERSION,
    "wsm.members": canonical_json(
        {
            name: {"dtype": STORED_DTYPES[name].str, "shape": [AXIS_COLUMNS.get(axis, axis) for axis in axes]}
            for name, (_, axes) in MEMBERS.items()
        }
        | {META: {"file": META_MEMBER}}
    ),
}
SCHEMA = pa.schema(
    [(name, pa.string()) for name in UNIQUE_COLUMNS]
    + [(name, pa.dictionary(pa.int32(), pa.string())) for name in REPEATED_COLUMNS]
    + [(name, pa.int32()) for name in COUNT_COLUMNS]
    + [(name, pa.int64()) for name in PLACE_COLUMNS]
    + [(name, pa.uint64()) for name in CHECKSUM_COLUMNS],
    metadata=_METADATA,
)


@dataclass(frozen=True, kw_only=True)
class IndexRow:
    """Where a clip stands and what it is; see docs/format.md for the columns.

    Attributes:
        key: key of the clip.
        split: `train`, `test`, ...
        shard: file name of its shard.
        position: number of the clip in its shard, from 0.
        clip_offset: first byte of the clip in the shard.
        clip_size: bytes of the clip with headers and padding.
        group: data set group.
        scene: scene in the group.
        episode: episode in the scene.
        physical_scene: the scene without its camera.
        camera: name of the camera.
        dataset: name of the source.
        padded_frames: repeated still frames at the end.
        codec_digest: digest of the codec.
        source_digest: content digest of the trajectory.
        members: places from the first byte of the clip, dtypes, shapes and checksums.
        axes: lengths of the axes F, C, h, w, T, Y, X.
    """

    key: str
    split: str
    shard: str
    position: int
    clip_offset: int
    clip_size: int
    group: str
    scene: str
    episode: str
    physical_scene: str
    camera: str
    dataset: str
    padded_frames: int
    codec_digest: str
    source_digest: str
    members: tuple[Member, ...]
    axes: Mapping[str, int]

    @property
    def frames(self) -> int:
        """T, raw frames with padding."""
        return self.axes["T"]

    @property
    def latents(self) -> int:
        """F, latent frames with padding."""
        return self.axes["F"]

    @property
    def unit(self) -> str:
        """Unit id of the trajectory, `group/scene/episode`."""
        return f"{self.group}/{self.scene}/{self.episode}"


def index_row(info: FragmentInfo, *, split: str, shard: str, position: int, clip_offset: int) -> IndexRow:
    """The row of a clip whose fragment stands at `clip_offset` of a shard."""
    meta = info.meta
    axes: dict[str, int] = {}
    for member in info.members:
        names = MEMBERS[member.name][1] if member.name != META else ""
        axes.update({axis: length for axis, length in zip(names, member.shape, strict=True) if axis != "7"})
    return IndexRow(
        key=meta.key,
        split=split,
        shard=shard,
        position=position,
        clip_offset=clip_offset,
        clip_size=info.size_bytes,
        group=meta.id.group,
        scene=meta.id.scene,
        episode=meta.id.episode,
        physical_scene=meta.id.physical_scene,
        camera=meta.id.camera,
        dataset=meta.dataset,
        padded_frames=meta.padded_frames,
        codec_digest=meta.codec_digest,
        source_digest=meta.source_digest,
        members=info.members,
        axes=axes,
    )


def row_record(row: IndexRow) -> dict[str, Any]:
    """Values of a row by column."""
    record = {name: getattr(row, name) for name in (*UNIQUE_COLUMNS, *REPEATED_COLUMNS, "position", "padded_frames")}
    record |= {column: row.axes[axis] for axis, column in AXIS_COLUMNS.items()}
    record |= {"clip_offset": row.clip_offset, "clip_size": row.clip_size}
    record |= {f"{name}_{what}": 0 for name in DEPTH_MEMBERS for what in ("offset", "size", "checksum")}
    for member in row.members:
        record[f"{member.name}_offset"] = row.clip_offset + member.array_offset
        record[f"{member.name}_size"] = member.array_size
        record[f"{member.name}_checksum"] = int(member.checksum, 16)
    return record


def parse_row(record: Mapping[str, Any]) -> IndexRow:
    """Inverse of `row_record`.

    Raises:
        IntegrityError: the members do not stand where those of a clip of this key and shape stand.
    """
    try:
        row = _row(record)
    except (ValueError, TypeError) as error:  # a length below zero, an empty cell
        raise _contradiction(record) from error
    if row_record(row) != record or row.members[-1].end_offset != row.clip_size:
        raise _contradiction(record)
    return row


def _row(record: Mapping[str, Any]) -> IndexRow:
    axes = {axis: record[column] for axis, column in AXIS_COLUMNS.items()}
    members = lay_out(
        record["key"],
        axes=axes,
        meta_size=record[f"{META}_size"],
        checksums={name: f"{record[f'{name}_checksum']:016x}" for name in MEMBER_NAMES if _is_there(name, record)},
    )
    return IndexRow(
        **{name: record[name] for name in (*UNIQUE_COLUMNS, *REPEATED_COLUMNS, "position", "padded_frames")},
        clip_offset=record["clip_offset"],
        clip_size=record["clip_size"],
        members=members,
        axes=axes,
    )


def _is_there(name: str, record: Mapping[str, Any]) -> bool:
    return name not in DEPTH_MEMBERS or record[f"{name}_size"] > 0


def _contradiction(record: Mapping[str, Any]) -> IntegrityError:
    return IntegrityError(
        f"{record['shard']}, clip {record['key']}: its row in {INDEX_NAME} places members where clips of this key and "
        "shape do not have them; restore the index"
    )
