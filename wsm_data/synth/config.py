"""What a synthetic source is made of: cameras, sizes, and the conventions it is written in."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.source.layout import Layout

CAMERAS: Mapping[str, Intrinsics] = MappingProxyType(
    {
        "d435i": Intrinsics(fx=355.81, fy=351.69, cx=240.0, cy=135.0, width=480, height=270),
        "zed": Intrinsics(fx=476.6, fy=476.6, cx=320.0, cy=180.0, width=640, height=360),
    }
)
"""The two cameras of InternData-N1: d435i as measured on it, zed as in the start-goal benchmark's robot."""


class Matrices(StrEnum):
    """How a column of the parquet files holds matrices: as a list of rows, or as one list of all numbers."""

    NESTED = "nested"
    FLAT = "flat"


@dataclass(frozen=True, kw_only=True)
class SynthConfig:
    """Settings of a synthetic source; equal settings give equal bytes.

    Attributes:
        seed: everything random follows from it.
        scenes: number of physical scenes.
        trajectories: trajectories per scene and camera.
        cameras: names out of `CAMERAS`; every scene is recorded once with each.
        group_prefix: groups are named `<prefix>_<camera>`.
        layout: how the files are laid out.
        matrices: how the parquet files hold matrices.
        image_scale: scale of the images against the cameras' own; below 1 for tests.
        min_frames: shortest trajectory.
        max_frames: longest trajectory.
        min_step_m: shortest way between two frames, m.
        max_step_m: longest way between two frames, m; the step is steady within a trajectory.
        min_camera_height_m: lowest mount above the floor, m; the robot is as tall as its mount.
        max_camera_height_m: highest mount above the floor, m.
        max_pitch_deg: steepest mount, degrees down from the horizontal; the least is 0.
        robot_radius_m: radius of the robot, a standing cylinder, m.
        planning_margin_m: what the expert keeps free beyond the robot's radius, m.
        ground_clearance_m: what is lower is driven over, m.
        head_room_m: what the expert keeps free above the robot, m.
        comfortable_clearance_m: the expert prefers to stay this far from obstacles, m.
        floor_spacing_m: distance between neighbouring points of the cloud on floors, m.
        surface_spacing_m: distance between neighbouring points of the cloud on everything else, m.
        obstacle_slice_m: surfaces between these heights above the floor are marked as obstacles, m.
        noise_sigma: standard deviation of the sensor noise in RGB, of 255.
        jpeg_quality: quality of the colour images.
        png_level: deflate level of the depth images (zlib-ng).
        metres_per_depth_unit: m of one step of the depth images.
        archive_level: deflate level of the archives (zlib-ng); what is in them hardly compresses any further.
    """

    seed: int = 0
    scenes: int = 3
    trajectories: int = 4
    cameras: tuple[str, ...] = ("d435i", "zed")
    group_prefix: str = "synth"
    layout: Layout = Layout.SCENE_ARCHIVE
    matrices: Matrices = Matrices.NESTED
    image_scale: float = 1.0
    min_frames: int = 120
    max_frames: int = 320
    min_step_m: float = 0.03
    max_step_m: float = 0.06
    min_camera_height_m: float = 0.25
    max_camera_height_m: float = 1.5
    max_pitch_deg: float = 30.0
    robot_radius_m: float = 0.25
    planning_margin_m: float = 0.05
    ground_clearance_m: float = 0.15
    head_room_m: float = 0.05
    comfortable_clearance_m: float = 0.6
    floor_spacing_m: float = 0.02
    surface_spacing_m: float = 0.04
    obstacle_slice_m: tuple[float, float] = (0.15, 0.4)
    noise_sigma: float = 1.5
    jpeg_quality: int = 92
    png_level: int = 2
    metres_per_depth_unit: float = 1e-4
    archive_level: int = 1

    def __post_init__(self) -> None:
        for camera in self.cameras:
            if camera not in CAMERAS:
                raise ValueError(f"cameras must be of {', '.join(CAMERAS)}, found {camera!r}")
        for name in ("scenes", "trajectories"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")
        _require_range("frames", 2, self.min_frames, self.max_frames, 999)
        _require_range("step_m", 1e-3, self.min_step_m, self.max_step_m, 1.0)
        _require_range("camera_height_m", 0.2, self.min_camera_height_m, self.max_camera_height_m, 1.9)
        if not 0 < self.image_scale <= 4:
            raise ValueError(f"image_scale must lie in (0, 4], found {self.image_scale}")

    def group(self, camera: str) -> str:
        """Name of the group that holds the recordings of one camera."""
        return f"{self.group_prefix}_{camera}"

    def scene_name(self, scene_index: int) -> str:
        """Name of a physical scene, the same under every camera."""
        return f"home_{scene_index + 1:04d}"

    def intrinsics(self, camera: str) -> Intrinsics:
        """Intrinsics of a camera at the size it is rendered in."""
        full = CAMERAS[camera]
        if self.image_scale == 1.0:
            return full
        return full.resized(round(full.width * self.image_scale), round(full.height * self.image_scale))


def _require_range(name: str, least: float, low: float, high: float, most: float) -> None:
    if not least <= low <= high <= most:
        raise ValueError(f"{least} <= min_{name} <= max_{name} <= {most} must hold, found {low} and {high}")
