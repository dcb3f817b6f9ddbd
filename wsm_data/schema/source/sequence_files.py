"""How a recorded sequence lies on disk: names of its files, tolerances in time, axes of its world."""

from dataclasses import dataclass
from enum import StrEnum

MATRIX_NUMBERS = 16
"""Numbers of a 4 x 4 matrix."""


class WorldAxes(StrEnum):
    """What a source's world axes mean; the project's world has z up."""

    Z_UP = "z_up"
    Y_UP = "y_up"
    Y_DOWN = "y_down"
    Y_UP_LEFT_HANDED = "y_up_left_handed"  # the camera's axes are left-handed too: x right, y up, z forward


@dataclass(frozen=True, kw_only=True)
class SequenceFiles:
    """The files of a sequence, relative to its folder; the defaults are those of TUM's RGB-D benchmark.

    A name with a `*` stands for numbered files, and the last number in their names is their time; a name without one
    is a text file of lines, with `#` before comments.

    Attributes:
        rgb: lines of `stamp file`, or the colour images themselves.
        depth: the same of depth; empty where the source has none.
        poses: lines of `stamp x y z qx qy qz qw`, lines of 16 numbers (a 4 x 4 matrix by rows, the n-th of image
            number n), or files of one such matrix each.
        camera: `fx fy cx cy`, or a 3 x 3 or 4 x 4 camera matrix; where a sequence has no such file, its camera is the
            published one.
        max_depth_lag_s: a colour image belongs to the nearest depth image at most so far away, s; one that has none
            is left out.
        max_pose_gap_s: poses are interpolated between two that lie at most so far apart, s; an image at whose time
            there is none is left out.
        world: axes of the world of the poses.
        T_tracked_camera: where poses are those of a tracked body and not of the camera: the camera in the frame of that
            body, a rigid 4 x 4 matrix by rows.
    """

    rgb: str = "rgb.txt"
    depth: str = "depth.txt"
    poses: str = "groundtruth.txt"
    camera: str = "camera.txt"
    max_depth_lag_s: float = 0.02
    max_pose_gap_s: float = 0.1
    world: WorldAxes = WorldAxes.Z_UP
    T_tracked_camera: tuple[float, ...] = (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)

    def __post_init__(self) -> None:
        if not self.rgb or not self.poses:
            raise ValueError("a sequence must have names for its colour images and its poses, found an empty one")
        if len(self.T_tracked_camera) != MATRIX_NUMBERS:
            raise ValueError(f"T_tracked_camera must be {MATRIX_NUMBERS} numbers, found {len(self.T_tracked_camera)}")
        for name in ("max_depth_lag_s", "max_pose_gap_s"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} must be finite and not negative, found {getattr(self, name)}")
