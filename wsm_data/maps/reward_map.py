"""What the reward of post-training asks of a map: distances to the goal, progress, and whether a path is free."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsm_data.maps.footprint import footprint_is_free
from wsm_data.maps.progress import mm_to_field, progress, sample_distance
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint16Array
from wsm_data.schema.occupancy import OccupancyGrid


@dataclass(frozen=True, kw_only=True, eq=False)
class RewardMap:
    """A map crop and its distance field (paper, appendix on post-training). Positions are planar.

    Attributes:
        grid: what is free.
        geodesic_mm: distance to the goal region, mm; uint16 [Y, X], 65535 where there is none.
        robot_radius_m: radius of the robot's footprint, m.
    """

    grid: OccupancyGrid
    geodesic_mm: Uint16Array
    robot_radius_m: float

    def distance_m(self, xy_m: Float64Array) -> Float64Array:
        """Geodesic distance D to the goal region at positions in the world.

        Args:
            xy_m: positions, m; [..., 2].

        Returns:
            float64 [...], m; infinite where no neighbouring cell has a distance.
        """
        points = np.asarray(xy_m, np.float64)
        return sample_distance(self._field_m, self.grid, points.reshape(-1, 2)).reshape(points.shape[:-1])

    def progress_m(self, path_xy_m: Float64Array) -> Float64Array:
        """Progress of each step of a path towards the goal, D(l - 1) - D(l).

        Args:
            path_xy_m: positions in the world, the one of the query frame first, m; [L + 1, 2].

        Returns:
            float64 [L], m; not finite where an end of the step has no distance.
        """
        with np.errstate(invalid="ignore"):  # from nowhere to nowhere: infinite minus infinite
            return progress(self.distance_m(path_xy_m))

    def is_free(self, path_xy_m: Float64Array) -> bool:
        """Whether the footprint along a path stays in free space: the safety indicator s; positions as above."""
        return footprint_is_free(self.grid, path_xy_m, self.robot_radius_m)

    @cached_property
    def _field_m(self) -> Float32Array:
        return mm_to_field(self.geodesic_mm)
