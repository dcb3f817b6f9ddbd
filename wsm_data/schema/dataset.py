"""The conventions of a source, as its manifest under manifests/datasets/ states them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.source.check_limits import CheckLimits
from wsm_data.schema.source.lerobot_features import LerobotFeatures
from wsm_data.schema.source.motion import Motion
from wsm_data.schema.source.sequence_files import SequenceFiles


@dataclass(frozen=True, kw_only=True)
class Robot:
    """The body for which a source's expert planned.

    Attributes:
        radius_m: radius of the cylinder, m.
        ground_clearance_m: what is lower above the floor is driven over, m.
    """

    radius_m: float = 0.25
    ground_clearance_m: float = 0.15


@dataclass(frozen=True, kw_only=True)
class CloudColours:
    """How the points of a coloured scene cloud are told apart; colours in [0, 1], distance is the sum of |difference|.

    Attributes:
        obstacle_rgb: colour of obstacle points.
        path_rgb: colour of expert path points, which are not part of the scene.
        tolerance: colours nearer than this count as equal.
    """

    obstacle_rgb: tuple[float, float, float] = (0.0, 0.0, 0.5)
    path_rgb: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tolerance: float = 0.05


@dataclass(frozen=True, kw_only=True)
class CameraModel:
    """What is published about a camera of a source; None where nothing is.

    Attributes:
        width: image width, px.
        height: image height, px.
        fx: focal length, px.
        fy: focal length, px.
        cx: principal point, px.
        cy: principal point, px.
    """

    width: int | None = None
    height: int | None = None
    fx: float | None = None
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None


@dataclass(frozen=True, kw_only=True)
class ReadLimits:
    """What is refused unread, or undecoded: each limit is compared with what a file declares, before memory is taken.

    Attributes:
        max_frames: images of one trajectory, and rows of its table.
        max_file_bytes: of any file that is read, after decompression. The largest of a scene is its cloud: 1 GiB is
            70 million points.
        max_json_bytes: of a file of JSON lines; parsed, they need ten times as much.
        max_image_pixels: of an image, width times height.
    """

    max_frames: int = 100_000
    max_file_bytes: int = 1 << 30
    max_json_bytes: int = 1 << 24
    max_image_pixels: int = 1 << 24

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            if value < 1:
                raise ValueError(f"{limit.name} must be at least 1, found {value}")


@dataclass(frozen=True, kw_only=True)
class DatasetManifest:
    """Every convention the reader applies; nothing about a source stands in code.

    Attributes:
        name: name of the data set, stored in every clip.
        reader: the kind of source, as `readers/registry.py` names it.
        licence: licence of the source, as its publisher states it.
        homepage: where the source is described.
        camera_axes: axes of the stored camera poses: `opengl` (x right, y up, z backward) or `opencv`.
        depth: how depth images are stored.
        robot: the expert's body.
        cloud: colours of the scene cloud.
        cameras: published camera models by camera name (the last word of a group).
        max_camera_height_m: mounts above this are taken for damage, m.
        max_pitch_deg: mounts pitched down by more are taken for damage, degrees.
        motion: how the camera is carried, and which frames are kept.
        files: how the files of a sequence are named, for readers of sequences.
        features: which features hold what, for LeRobot data sets.
        checks: the other limits beyond which a trajectory is refused.
        limits: what is too large to be read.
        min_frames: shorter trajectories are refused.
        expected_episodes: published number of episodes by group, to compare with what is found.
    """

    name: str
    reader: str = "interndata"
    licence: str
    homepage: str = ""
    camera_axes: str = "opengl"
    depth: DepthEncoding
    robot: Robot = field(default_factory=Robot)
    cloud: CloudColours = field(default_factory=CloudColours)
    cameras: Mapping[str, CameraModel] = field(default_factory=dict)
    max_camera_height_m: float = 2.0
    max_pitch_deg: float = 45.0
    motion: Motion = field(default_factory=Motion)
    files: SequenceFiles = field(default_factory=SequenceFiles)
    features: LerobotFeatures = field(default_factory=LerobotFeatures)
    checks: CheckLimits = field(default_factory=CheckLimits)
    limits: ReadLimits = field(default_factory=ReadLimits)
    min_frames: int = 5
    expected_episodes: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.camera_axes not in ("opengl", "opencv"):
            raise ValueError(f"camera_axes must be 'opengl' or 'opencv', found {self.camera_axes!r}")
