"""Which features of a LeRobot data set hold what a trajectory is made of."""

from dataclasses import dataclass
from enum import StrEnum


class PoseForm(StrEnum):
    """How a pose stands in a feature of numbers."""

    MATRIX = "matrix"  # 16 numbers, camera to world by rows
    XYZ_WXYZ = "xyz_wxyz"  # position and quaternion, real part first
    XYZ_XYZW = "xyz_xyzw"  # position and quaternion, real part last


@dataclass(frozen=True, kw_only=True)
class LerobotFeatures:
    """The features of a LeRobot data set that are read; axes are those of the manifest's `camera_axes` and `files`.

    Attributes:
        rgb: the colour video.
        depth: the depth video, one that LeRobot quantised itself; empty where there is none, or none is wanted.
        pose: pose of the camera in a world, m.
        pose_form: how it stands there.
        intrinsics: `fx fy cx cy`, or a 3 x 3 matrix by rows; empty: the published camera of the manifest.
        camera: name of the camera, without `_`; one of `cameras` in the manifest where it is a published one.
    """

    rgb: str = "observation.images.rgb"
    depth: str = ""
    pose: str = "observation.camera_pose"
    pose_form: PoseForm = PoseForm.MATRIX
    intrinsics: str = ""
    camera: str = "camera"

    def __post_init__(self) -> None:
        if not self.rgb or not self.pose:
            raise ValueError("a LeRobot data set must have names for its colour video and its pose, found an empty one")
        if "_" in self.camera or not self.camera:
            raise ValueError(f"the name of a camera must not be empty or hold '_', found {self.camera!r}")
