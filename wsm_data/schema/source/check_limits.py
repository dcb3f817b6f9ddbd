"""How far a source's trajectories may stray before they are taken for damage."""

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True, kw_only=True)
class CheckLimits:
    """The limits of the checks that depend on robot, camera and sensor; the defaults suit InternData-N1.

    Attributes:
        min_camera_height_m: lowest mount above the floor, m.
        max_pitch_up_deg: a level mount may point up by so much, degrees: calibration, not intent.
        max_pitch_disagreement_deg: between the mount's pitch and that of any pose, degrees; small where a robot drives
            on flat floors.
        max_roll_deg: of any pose, degrees. Poses in the wrong camera axes are upside down.
        min_jump_m: shorter steps between two frames are never a jump, m.
        min_jump_deg: nor smaller turns, degrees: a path may turn sharply where a spline has a corner.
        max_centre_offset: distance of the principal point from the image centre, as a share of the side. Intrinsics of
            another image size are off by at least an eighth (640 against 480 px: 0.17).
        max_field_of_view_deg: widest horizontal field of view, degrees: beyond it a pinhole image is hardly usable.
        max_published_error: relative deviation from the published focal lengths, and of the principal point as a share
            of the side, where the image size is the published one.
        max_depth_error: median of |predicted depth / depth there - 1| along the poses; the noise of a sensor is part of
            it. With exact depth a right pose errs by the rounding of the depth, 1e-4; wrong axes err by twice the
            motion, 4 % for 0.06 m at 3 m.
        min_path_clearance_m: nearest an expert's camera may come to an obstacle, m. The smallest clearance measured in
            InternData-N1 is 0.21 m, and a map of 0.05 m cells misplaces path and obstacle by up to half a cell's
            diagonal each, 0.035 m. So a sound path keeps 0.14 m on the map; under 0.10 m the path, the map or their
            alignment is wrong.
        min_cloud_share: least share of the points of depth images, over the floor and above it, that lie within a
            voxel of the scene's cloud. On generated homes it is 0.99 and more, with the noise of a Kinect and poses
            that jitter by 1 cm and 0.5 degrees too; a cloud moved by 0.3 m or more leaves 0.71 at most of one of them.
        min_colour_correlation: least rank correlation of brightness over points that two frames see, median over pairs
            of frames. On generated homes it is 0.92 and more, 0.79 with a Kinect's noise and jittering poses.
        max_repeated_share: largest share of images that are copies of others between which the camera moved. None of a
            renderer's are; a sensor that falls behind hands out its last image again, and the manifests of recorded
            sequences allow for one in twenty. More than three alike in a row are refused in any case.
        min_measured_share: least share of the pixels of depth images that are measured.
        max_depth_step_m: largest step that all depth of a trajectory may be multiples of, m. A Kinect's is 1 mm; 8 bits
            over 5 m leave 20.
        max_unknown_path_share: largest share of the path over cells of the floor that the scene's cloud never showed.
    """

    min_camera_height_m: float = 0.05
    max_pitch_up_deg: float = 2.0
    max_pitch_disagreement_deg: float = 3.0
    max_roll_deg: float = 5.0
    min_jump_m: float = 0.3
    min_jump_deg: float = 60.0
    max_centre_offset: float = 0.1
    max_field_of_view_deg: float = 130.0
    max_published_error: float = 0.03
    max_depth_error: float = 0.02
    min_path_clearance_m: float = 0.10
    min_cloud_share: float = 0.75
    min_colour_correlation: float = 0.6
    max_repeated_share: float = 0.0
    min_measured_share: float = 0.25
    max_depth_step_m: float = 0.005
    max_unknown_path_share: float = 0.5

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (value >= 0 and math.isfinite(value)):
                raise ValueError(f"{field.name} must be finite and not negative, found {value}")
        if self.max_depth_error == 0:
            raise ValueError("max_depth_error must be above 0: depth is rounded, found 0")
