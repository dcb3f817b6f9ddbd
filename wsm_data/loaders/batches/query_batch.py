"""What post-training is given of a step: histories up to the replan latents, and the maps that score dreams."""

from dataclasses import dataclass

import numpy as np
import torch

from wsm_data.loaders.batches.batch import Batch
from wsm_data.maps.reward_map import RewardMap
from wsm_data.schema.occupancy import OccupancyGrid


@dataclass(frozen=True, kw_only=True, eq=False)
class QueryBatch:
    """Queries of one rank of one global step: N histories and their maps. Everything but `history` is on the processor.

    Maps of different sizes share one tensor: beyond `map_shape` a map is unknown and without a distance.

    Attributes:
        history: the clips up to their replan latents and with them; sequence n is query n.
        replan_latent: number of the last latent of each history in its clip; int64 [N].
        occupancy: 0 free, 1 occupied, 255 unknown; uint8 [N, Y, X].
        geodesic_mm: distance to the goal region, mm; uint16 [N, Y, X], 65535 unreachable or occupied.
        map_shape: rows and columns of each map; int64 [N, 2].
        map_origin_m: x and y of the lower corner of cell (0, 0) in the world, m; float64 [N, 2].
        resolution_m: side of a cell, m; float64 [N].
        T_world_camera0: first camera of the clip to world, m; float64 [N, 4, 4].
        T_world_camera: camera at the last frame of the replan latent to world, m; float64 [N, 4, 4].
        goal_world_m: last camera position of the clip in the world, m; float64 [N, 3].
        goal_radius_m: radius of the goal region, m; float64 [N].
        robot_radius_m: radius of the robot's footprint, m; float64 [N].
        expert_distance_m: distance of the expert to the goal at the last frame of the replan latent and at each of the
            frames of the real future that follow, m; float32 [N, 1 + 4 future_latents].
    """

    history: Batch
    replan_latent: torch.Tensor
    occupancy: torch.Tensor
    geodesic_mm: torch.Tensor
    map_shape: torch.Tensor
    map_origin_m: torch.Tensor
    resolution_m: torch.Tensor
    T_world_camera0: torch.Tensor
    T_world_camera: torch.Tensor
    goal_world_m: torch.Tensor
    goal_radius_m: torch.Tensor
    robot_radius_m: torch.Tensor
    expert_distance_m: torch.Tensor

    def map_of(self, number: int) -> RewardMap:
        """The map of query `number`."""
        rows, columns = self.map_shape[number].tolist()
        resolution_m = float(self.resolution_m[number])
        ix, iy = np.rint(self.map_origin_m[number].numpy() / resolution_m).astype(int).tolist()
        grid = OccupancyGrid(
            cells=self.occupancy[number, :rows, :columns].numpy(), origin_cell=(ix, iy), resolution_m=resolution_m
        )
        field_mm = self.geodesic_mm[number, :rows, :columns].numpy()
        return RewardMap(grid=grid, geodesic_mm=field_mm, robot_radius_m=float(self.robot_radius_m[number]))
