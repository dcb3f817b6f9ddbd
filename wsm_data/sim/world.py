"""What the simulator asks of a world, whoever made it."""

from typing import Protocol

from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array
from wsm_data.schema.occupancy import OccupancyGrid


class World(Protocol):
    """A static scene with a level floor at z = 0; world coordinates, m, z up.

    Attributes:
        scene: its name in tables.
        grid: occupancy for the simulator's robot: what planners that know the map are given, and where episodes start.
    """

    @property
    def scene(self) -> str:
        """Name in tables."""
        ...

    @property
    def grid(self) -> OccupancyGrid:
        """Occupancy for the robot."""
        ...

    def render(self, T_world_camera: Float64Array) -> tuple[Uint8Array, Float32Array]:
        """What the camera sees, rgb [H, W, 3] and depth along the optical axis [H, W], m, 0 where nothing is.

        The arrays are valid until the next call.
        """
        ...

    def clearance_m(self, xy_m: Float64Array) -> Float64Array:
        """Distance of positions [N, 2] to the nearest obstacle at the robot's height, m; float64 [N].

        It is exact up to twice the robot's radius at least, and not below that where it is farther.
        """
        ...
