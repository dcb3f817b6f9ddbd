"""One trajectory after the reader: every unit, axis and name converted, frames still lazy."""

from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float64Array, frozen_array, require_array, require_finite
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.identity import EpisodeId


@dataclass(frozen=True, kw_only=True)
class EpisodeRecord:
    """A trajectory of T raw frames, in the project's frames and units.

    Attributes:
        id: what the trajectory is called in every layout.
        container: path of its archive or folder relative to the source root, with `/`.
        rgb_members: names of the T colour images inside the container, in time order.
        depth_members: names of the T depth images inside the container, in time order, empty where a frame has none.
        T_world_camera: camera to world, OpenCV camera (x right, y down, z forward), world z up, m; float64 [T, 4, 4].
        intrinsics: at the size of the stored images.
        camera_height_m: height of the camera above the floor, m; also the height of the robot.
        camera_pitch_rad: pitch down from the horizontal, rad.
        frames_digest: digest of the image bytes in time order; compared again when the frames are read.
        content_digest: digest of image bytes, poses, intrinsics and mount; the same in every layout.
        notes: reason codes of what was accepted but is worth knowing.
        goal_world_m: where the expert drives to, in the world, at the height of the camera, m; None where the source
            does not say: the last camera position.
    """

    id: EpisodeId
    container: str
    rgb_members: tuple[str, ...]
    depth_members: tuple[str, ...]
    T_world_camera: Float64Array
    intrinsics: Intrinsics
    camera_height_m: float
    camera_pitch_rad: float
    frames_digest: str
    content_digest: str
    notes: tuple[str, ...] = ()
    goal_world_m: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        frames = len(self.rgb_members)
        require_array("T_world_camera", self.T_world_camera, np.float64, (frames, 4, 4))
        require_finite("T_world_camera", self.T_world_camera)
        if len(self.depth_members) != frames:
            raise ValueError(f"{self.id.text}: {frames} colour images but {len(self.depth_members)} depth images")
        if self.goal_world_m is not None:
            require_finite("goal_world_m", np.array(self.goal_world_m))
        object.__setattr__(self, "T_world_camera", frozen_array(self.T_world_camera))

    @property
    def frame_count(self) -> int:
        """T, the number of raw frames."""
        return len(self.rgb_members)

    @property
    def has_depth(self) -> bool:
        """Whether any frame has a depth image; a trajectory without becomes a clip without depth."""
        return any(self.depth_members)

    @property
    def floor_z_m(self) -> float:
        """Height of the floor the robot starts on, in the world, m: the first camera's z less its mount height."""
        return float(self.T_world_camera[0, 2, 3]) - self.camera_height_m

    @property
    def goal_m(self) -> Float64Array:
        """Where the expert drives to, in the world, m; float64 [3]."""
        stated = self.T_world_camera[-1, :3, 3] if self.goal_world_m is None else self.goal_world_m
        return np.array(stated, np.float64)

    @property
    def path_xy_m(self) -> Float64Array:
        """Camera positions over the floor, in the world, m; float64 [T, 2]."""
        return np.asarray(self.T_world_camera[:, :2, 3])
