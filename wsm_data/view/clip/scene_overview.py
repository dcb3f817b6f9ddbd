"""All surveyed paths of one scene on one map: the crops of its clips laid over each other on the world's grid."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid
from wsm_data.view.clip.facts import world_path_m


@dataclass(frozen=True, kw_only=True)
class ScenePath:
    """What a clip contributes to the picture of its scene.

    Attributes:
        key: key of the clip.
        split: split of the clip.
        grid: the clip's crop of the scene's map.
        path_xy_m: positions of its camera, world, m; float64 [T, 2].
    """

    key: str
    split: str
    grid: OccupancyGrid
    path_xy_m: Float64Array


@dataclass(frozen=True, kw_only=True)
class SceneOverview:
    """A physical scene with the paths of some of its clips.

    Attributes:
        scene: name of the physical scene.
        grid: the crops joined; a cell is occupied where any crop says so, since cameras of different heights see
            different obstacles, and unknown where no crop covers or knows it.
        paths: the clips.
    """

    scene: str
    grid: OccupancyGrid
    paths: tuple[ScenePath, ...]


def scene_path(clip: Clip, split: str) -> ScenePath:
    """Take from a clip what the picture of its scene needs."""
    return ScenePath(key=clip.meta.key, split=split, grid=clip.grid, path_xy_m=world_path_m(clip)[:, :2])


def scene_overview(scene: str, paths: Sequence[ScenePath]) -> SceneOverview:
    """Join the crops of at least one clip of a scene."""
    return SceneOverview(scene=scene, grid=joined_grid([path.grid for path in paths]), paths=tuple(paths))


def joined_grid(grids: Sequence[OccupancyGrid]) -> OccupancyGrid:
    """Lay maps over each other on the world's grid; occupied wins over free, free over unknown.

    Raises:
        ValueError: the maps have different resolutions.
    """
    resolutions = {grid.resolution_m for grid in grids}
    if len(resolutions) != 1:
        raise ValueError(f"only maps of one resolution can be joined, found {sorted(resolutions)} m")
    low = np.min([grid.origin_cell for grid in grids], axis=0)
    high = np.max([np.add(grid.origin_cell, grid.cells.shape[::-1]) for grid in grids], axis=0)
    cells = np.full((high - low)[::-1], UNKNOWN, np.uint8)
    for grid in grids:
        column, row = np.subtract(grid.origin_cell, low)
        part = cells[row : row + grid.cells.shape[0], column : column + grid.cells.shape[1]]
        seen = grid.cells != UNKNOWN
        part[seen] = np.where((part[seen] == OCCUPIED) | (grid.cells[seen] == OCCUPIED), OCCUPIED, grid.cells[seen])
    return OccupancyGrid(cells=cells, origin_cell=(int(low[0]), int(low[1])), resolution_m=resolutions.pop())
