"""One stored sample: the arrays of a clip, the table of its members, and its provenance."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from wsm_data.schema.arrays import (
    Float16Array,
    Float32Array,
    Uint8Array,
    Uint16Array,
    frozen_array,
    require_array,
    require_finite,
)
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.schema.pose import IDENTITY_POSE, POSE_VALUES
from wsm_data.schema.sequence import POSE_SLOTS, TEMPORAL_RATIO, frames_of

MEMBERS: Mapping[str, tuple[np.dtype[np.generic], str]] = MappingProxyType(
    {
        "rgb_latent": (np.dtype(np.float16), "FChw"),
        "depth_latent": (np.dtype(np.float16), "FChw"),
        "depth_valid": (np.dtype(np.uint8), "Fhw"),
        "poses": (np.dtype(np.float32), "T7"),
        "occupancy": (np.dtype(np.uint8), "YX"),
        "geodesic_mm": (np.dtype(np.uint16), "YX"),
        "expert_distance": (np.dtype(np.float32), "T"),
    }
)
"""Array members of a clip in the order in which they are stored: dtype and axes. `meta.json` comes last."""

DEPTH_MEMBERS = ("depth_latent", "depth_valid")
"""Those that are absent, both, where the source has no depth."""

META_MEMBER = "meta.json"
UNREACHABLE_MM = 65535
_QUATERNION_TOLERANCE = 1e-5  # float32 rounding of four numbers of size one


@dataclass(frozen=True, kw_only=True, repr=False)
class Clip:
    """One sequence of T = 1 + 4k raw frames and F = 1 + k latent frames.

    Attributes:
        meta: provenance and everything that is a number rather than an array.
        rgb_latent: codec latents of the colour video, not standardised; float16 [F, C, h, w].
        depth_latent: codec latents of the log-depth video, not standardised; float16 [F, C, h, w]. None where the
            source has no depth.
        depth_valid: share of valid depth pixels per latent cell, 0..255; uint8 [F, h, w]. None likewise.
        poses: camera in the first camera's frame, xyz (m) and quaternion wxyz; float32 [T, 7], row 0 is the identity.
        occupancy: 0 free, 1 occupied, 255 unknown; uint8 [Y, X].
        geodesic_mm: distance to the goal region, mm; uint16 [Y, X], 65535 unreachable or occupied.
        expert_distance: geodesic distance D(x_t) of the expert, m; float32 [T].
    """

    meta: ClipMeta
    rgb_latent: Float16Array
    poses: Float32Array
    occupancy: Uint8Array
    geodesic_mm: Uint16Array
    expert_distance: Float32Array
    depth_latent: Float16Array | None = None
    depth_valid: Uint8Array | None = None

    def __post_init__(self) -> None:
        if (self.depth_latent is None) != (self.depth_valid is None):
            raise ValueError("depth_latent and depth_valid must be there both, or neither, found one of them")
        sizes: dict[str, int] = {}
        for name, array in self.arrays().items():
            dtype, axes = MEMBERS[name]
            shape = tuple(7 if axis == "7" else sizes.get(axis) for axis in axes)
            require_array(name, array, dtype, shape)
            sizes.update({axis: size for axis, size in zip(axes, array.shape, strict=True) if axis != "7"})
            if array.dtype.kind == "f":
                require_finite(name, array)
            object.__setattr__(self, name, frozen_array(array))
        frames, latents = sizes["T"], sizes["F"]
        if frames != frames_of(latents):
            raise ValueError(
                f"rgb_latent with F latent frames needs poses of T = 1 + {TEMPORAL_RATIO} (F - 1) raw frames, "
                f"found F = {latents}, T = {frames}"
            )
        if self.meta.frames != frames:
            raise ValueError(f"meta.frames must be the T = {frames} rows of poses, found {self.meta.frames}")
        _require_poses(self.poses)

    def __repr__(self) -> str:
        latent, cells = (" x ".join(map(str, shape)) for shape in (self.rgb_latent.shape[1:], self.occupancy.shape))
        return (
            f"<Clip {self.meta.key}: {self.frame_count} frames ({self.meta.padded_frames} padded), {self.latent_count} "
            f"latents {latent} of {self.meta.codec}, map {cells}>"
        )

    @property
    def has_depth(self) -> bool:
        """Whether the source has depth."""
        return self.depth_latent is not None

    @property
    def frame_count(self) -> int:
        """T, the number of raw frames, padding included."""
        return len(self.poses)

    @property
    def latent_count(self) -> int:
        """F, the number of latent frames, padding included."""
        return len(self.rgb_latent)

    @property
    def intrinsics(self) -> Intrinsics:
        """Camera at the size the latents decode to."""
        return self.meta.intrinsics

    @property
    def grid(self) -> OccupancyGrid:
        """The clip's crop of its scene's map, with its place in the world."""
        meta = self.meta
        return OccupancyGrid(cells=self.occupancy, origin_cell=meta.map_origin_cell, resolution_m=meta.map_resolution_m)

    @property
    def latent_poses(self) -> Float32Array:
        """Poses of the raw frames of each latent, as a batch has them; float32 [F, 4, 7], latent 0 four identities."""
        first = np.tile(np.array(IDENTITY_POSE, np.float32), (POSE_SLOTS - 1, 1))
        return np.concatenate([first, self.poses]).reshape(self.latent_count, POSE_SLOTS, POSE_VALUES)

    def arrays(self) -> dict[str, np.ndarray]:
        """The array members that are there, by name, in stored order."""
        return {name: array for name in MEMBERS if (array := getattr(self, name)) is not None}


def _require_poses(poses: Float32Array) -> None:
    identity = np.array(IDENTITY_POSE, np.float32)
    if not np.array_equal(poses[0], identity):
        raise ValueError(f"poses must start with the identity {identity.tolist()}, found {poses[0].tolist()}")
    error = np.abs(np.linalg.norm(poses[:, 3:].astype(np.float64), axis=1) - 1)
    if error.max() > _QUATERNION_TOLERANCE:
        raise ValueError(
            f"poses must hold unit quaternions, found one off by {error.max():.2e} in row {error.argmax()}"
        )
    if (poses[:, 3] < 0).any():
        raise ValueError(f"poses must hold quaternions of w >= 0, found w < 0 in row {int((poses[:, 3] < 0).argmax())}")
