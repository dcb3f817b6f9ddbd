"""Provenance of a clip and its small numbers: what stands in `meta.json`."""

import json
from dataclasses import dataclass

import numpy as np

from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.identity import EpisodeId

CLIP_FORMAT_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class ClipMeta:
    """Where a clip comes from and how it was made. Numbers are float64 and survive JSON to the bit.

    Attributes:
        key: key of the sample in its shard.
        id: the trajectory.
        dataset: name of the source's manifest.
        source_digest: content digest of the trajectory, the same in every layout it can be stored in.
        map_digest: digest of the level of the scene map that was cropped: its floor, and what stands on it.
        intrinsics: camera at the encoded size.
        T_world_camera0: first camera to world; 4 x 4 nested tuples, m.
        goal_world_m: the stated goal in the world, m; the last camera position where none is stated.
        goal_camera0_m: the same point in the first camera's frame, m.
        map_origin_cell: (ix, iy) of cell (0, 0) of the crop on the world's grid.
        map_resolution_m: side of a map cell, m.
        map_from: `cloud`, `depth`, or `path` where the source has neither: all that is known of the floor then is what
            the expert's footprint swept.
        freed_cells: unknown cells that are free because the expert's footprint swept them, or as filled holes.
        goal_radius_m: radius r_g of the goal region, m.
        robot_radius_m: radius of the footprint by which obstacles were inflated, m.
        camera_height_m: height of the camera above the floor, m.
        camera_pitch_rad: pitch down from the horizontal, rad.
        frames: T, raw frames in the clip, padding included.
        padded_frames: how many raw frames at the end repeat the last one.
        codec: name of the codec.
        codec_digest: digest of the codec's settings and weights.
        depth_range: metric range of the log-depth normalisation.
        latent_dtype: dtype in which latents are stored.
        notes: reason codes of what was accepted but is worth knowing.
        format_version: version of this format.
    """

    key: str
    id: EpisodeId
    dataset: str
    source_digest: str
    map_digest: str
    intrinsics: Intrinsics
    T_world_camera0: tuple[tuple[float, ...], ...]
    goal_world_m: tuple[float, float, float]
    goal_camera0_m: tuple[float, float, float]
    map_origin_cell: tuple[int, int]
    map_resolution_m: float
    map_from: str
    freed_cells: int
    goal_radius_m: float
    robot_radius_m: float
    camera_height_m: float
    camera_pitch_rad: float
    frames: int
    padded_frames: int
    codec: str
    codec_digest: str
    depth_range: DepthRange
    latent_dtype: str = "float16"
    notes: tuple[str, ...] = ()
    format_version: int = CLIP_FORMAT_VERSION

    def __post_init__(self) -> None:
        _require_version(self.format_version)
        if self.map_from not in ("cloud", "depth", "path"):
            raise ValueError(f"map_from must be 'cloud', 'depth' or 'path', found {self.map_from!r}")
        if not 0 <= self.padded_frames < self.frames:
            raise ValueError(f"padded_frames must lie in [0, frames = {self.frames}), found {self.padded_frames}")
        if [len(row) for row in self.T_world_camera0] != [4, 4, 4, 4]:
            raise ValueError(
                f"T_world_camera0 must be 4 x 4, found rows of {[len(row) for row in self.T_world_camera0]}"
            )

    @property
    def recorded_frames(self) -> int:
        """Raw frames that were recorded: all but the still ones at the end."""
        return self.frames - self.padded_frames

    @property
    def T_world_camera0_matrix(self) -> Float64Array:
        """First camera to world, float64 [4, 4], m."""
        return np.array(self.T_world_camera0, np.float64)


def meta_bytes(meta: ClipMeta) -> bytes:
    """The one spelling of meta.json."""
    return canonical_json(to_json(meta)).encode()


def parse_meta(data: bytes | memoryview) -> ClipMeta:
    """Inverse of `meta_bytes`.

    Raises:
        ValueError: it is no JSON object of exactly the fields of a clip's, or of another format version.
    """
    record = json.loads(bytes(data))
    _require_version(record.get("format_version") if isinstance(record, dict) else None)
    return from_json(ClipMeta, record)


def _require_version(found: object) -> None:
    if found != CLIP_FORMAT_VERSION:
        raise ValueError(f"clip format_version must be {CLIP_FORMAT_VERSION}, found {found!r}; use a matching wsm")
