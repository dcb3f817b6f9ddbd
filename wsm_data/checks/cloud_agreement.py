"""Does a scene's cloud show what the depth images of a trajectory see, in the same world?

Points of depth images stand in the world by the poses, and must lie within a voxel of the cloud. Those over the floor
and those above it are counted apart: a cloud of another home has a floor too, and walls are the same however high they
are lifted.
"""

from dataclasses import dataclass

import numpy as np

from wsm_data.checks.cloud_fit import fitting_placement
from wsm_data.errors import Reason
from wsm_data.maps.near_surface import near_surface
from wsm_data.maps.scene_map import FloorLevel
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import Robot
from wsm_data.schema.verdict import Verdict

MIN_POINTS = 200
"""A share is told from so many points: its standard error is then 0.035 at most."""


@dataclass(frozen=True, kw_only=True)
class HeightBands:
    """Points of depth images by their height over the floor.

    Attributes:
        ground_m: those within the ground clearance of the floor, above or below; float64 [N, 3].
        upright_m: those above, up to the height of the robot; float64 [M, 3].
    """

    ground_m: Float64Array
    upright_m: Float64Array


def height_bands(points_world_m: Float64Array, floor_z_m: float, robot: Robot, robot_height_m: float) -> HeightBands:
    """Sort world points [N, 3] (m) by their height over the floor; what is higher than the robot is left out."""
    height_m = points_world_m[:, 2] - floor_z_m
    ground = np.abs(height_m) <= robot.ground_clearance_m
    upright = (height_m > robot.ground_clearance_m) & (height_m < robot_height_m)
    return HeightBands(ground_m=points_world_m[ground], upright_m=points_world_m[upright])


def check_cloud_agreement(bands: HeightBands, level: FloorLevel, where: str, min_share: float) -> Verdict:
    """Refuse a trajectory whose depth sees another place than the cloud shows (`cloud.disagrees`).

    On failure the cloud is tried with y up, mirrored, turned, shifted and larger; what fits clearly better is named.

    Args:
        bands: points of depth images of the trajectory.
        level: the floor of the cloud that the trajectory lies on.
        where: what to call the trajectory in the message.
        min_share: share of the points of each band that must lie within a voxel of the cloud. Bands of fewer than
            `MIN_POINTS` points tell nothing.
    """
    shares = {
        name: float(np.mean(near_surface(level, points)))
        for name, points in (("floor", bands.ground_m), ("upright", bands.upright_m))
        if len(points) >= MIN_POINTS
    }
    measured: dict[str, object] = {f"{name}_points_near_cloud": share for name, share in shares.items()}
    limits = dict.fromkeys(measured, min_share)
    if all(share >= min_share for share in shares.values()):
        return Verdict(measured=measured, limits=limits)
    points_m = np.concatenate([bands.ground_m, bands.upright_m])
    fits = fitting_placement(level, points_m, bands.upright_m)
    found = " and ".join(f"{share:.0%} of the {name} points" for name, share in shares.items())
    advice = (
        f"the cloud fits if it is taken for one {fits}: correct it, or the poses"
        if fits is not None
        else "no other placement of the cloud was found to fit: is it the cloud of this scene, in metres with z up?"
    )
    message = (
        f"{where}: at least {min_share:.0%} of the points that depth images show must lie within a voxel of the "
        f"scene's cloud, found {found}; {advice}"
    )
    details = {**measured, "fits": fits}
    return Verdict(reason=Reason.CLOUD_DISAGREES, message=message, measured=details, limits=limits)
