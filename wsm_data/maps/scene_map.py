"""The surface of a scene around each of its floors: what is kept to cut an occupancy map for any robot height."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.maps.arrays_file import arrays_digest, load_arrays, save_arrays
from wsm_data.schema.arrays import BoolArray, Int16Array, frozen_array, require_array
from wsm_data.schema.dataset import Robot
from wsm_data.schema.surface import CELL_SIZE_M, LAYER_HEIGHT_M, SurfaceVoxels

LEVEL_STEP_M = 0.5
"""Floors are gathered into levels at multiples of this, each for the floors within half a step of it. Storeys lie
farther apart, so a level holds one; and it depends on its own floors only, not on which others were seen."""

MAX_MAP_CELLS = 1 << 24
"""A map of 16.8 million cells covers 200 m x 200 m; anything larger is a stray point, not a home."""

_NAMES = ("floor_z_m", "origin_cell", "shape", "first_box", "layers", "obstacle", "origin")


@dataclass(frozen=True, kw_only=True)
class FloorLevel:
    """The surface boxes between a level's lowest floor and the top of the tallest robot on it, cell by cell.

    The boxes of cell (row, column) are `layers[first[i]:first[i + 1]]` with i = row * X + column.

    Attributes:
        floor_z_m: the level, a multiple of LEVEL_STEP_M, m.
        origin_cell: (ix, iy) of the first column and row on the world's grid.
        shape: (Y, X), rows and columns.
        first: where the boxes of each cell begin; int32 [Y X + 1].
        layers: iz of the boxes on the world's grid, rising within a cell; int16 [N].
        obstacle: whether the source marks the box as an obstacle; bool [N].
    """

    floor_z_m: float
    origin_cell: tuple[int, int]
    shape: tuple[int, int]
    first: np.ndarray
    layers: Int16Array
    obstacle: BoolArray

    def __post_init__(self) -> None:
        require_array("first", self.first, np.int32, (self.shape[0] * self.shape[1] + 1,))
        require_array("layers", self.layers, np.int16, (int(self.first[-1]),))
        require_array("obstacle", self.obstacle, np.bool_, (len(self.layers),))
        if self.first[0] != 0 or (np.diff(self.first) < 0).any():
            raise ValueError("first must start with 0 and never fall")
        for name in ("first", "layers", "obstacle"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class SceneMap:
    """A scene's floors and what stands on them.

    Attributes:
        levels: by rising floor.
        origin: `cloud`, `depth` where depth images were fused, or `path` where nothing shows the scene.
    """

    levels: tuple[FloorLevel, ...]
    origin: str

    def level_at(self, floor_z_m: float) -> FloorLevel:
        """The level that a floor belongs to.

        Raises:
            ValueError: the map was built without this floor.
        """
        wanted = _level_z_m(floor_z_m)
        for level in self.levels:
            if level.floor_z_m == wanted:
                return level
        raise ValueError(
            f"no level at {wanted} m for a floor at {floor_z_m} m, found {[x.floor_z_m for x in self.levels]}"
        )


def floor_levels(floors_z_m: Iterable[float]) -> tuple[float, ...]:
    """Levels of the floors that the episodes of a scene start on, rising, each once; multiples of LEVEL_STEP_M."""
    return tuple(sorted({_level_z_m(z) for z in floors_z_m}))


def _level_z_m(floor_z_m: float) -> float:
    return float(np.floor(floor_z_m / LEVEL_STEP_M + 0.5) * LEVEL_STEP_M) + 0.0  # never -0.0


def build_scene_map(voxels: SurfaceVoxels, levels_z_m: Sequence[float], robot: Robot, max_height_m: float) -> SceneMap:
    """Sort a scene's boxes into levels.

    Args:
        voxels: the scene's surface.
        levels_z_m: what `floor_levels` returned, m.
        robot: how far below its floor a surface may lie and still be driven over.
        max_height_m: height of the tallest robot, m.

    Raises:
        DataError: `map.too_large` when the boxes of a level lie farther apart than any home is wide.
    """
    levels = tuple(_build_level(voxels, z, robot, max_height_m) for z in sorted(levels_z_m))
    return SceneMap(levels=levels, origin=voxels.origin)


def _build_level(voxels: SurfaceVoxels, level_z_m: float, robot: Robot, max_height_m: float) -> FloorLevel:
    """Keep the boxes in reach of any floor of the level, one layer more on either side for rounding."""
    lowest = np.floor((level_z_m - LEVEL_STEP_M / 2 - robot.ground_clearance_m) / LAYER_HEIGHT_M) - 1
    highest = np.ceil((level_z_m + LEVEL_STEP_M / 2 + max_height_m) / LAYER_HEIGHT_M) + 1
    kept = (voxels.cells[:, 2] >= lowest) & (voxels.cells[:, 2] <= highest)
    cells, obstacle = voxels.cells[kept].astype(np.int64), voxels.obstacle[kept]
    if not len(cells):
        first = np.zeros(1, np.int32)
        return FloorLevel(
            floor_z_m=level_z_m,
            origin_cell=(0, 0),
            shape=(0, 0),
            first=first,
            layers=np.zeros(0, np.int16),
            obstacle=obstacle,
        )
    low, high = cells[:, :2].min(axis=0), cells[:, :2].max(axis=0)
    columns, rows = (int(n) for n in high - low + 1)
    _require_home_size(columns, rows, level_z_m)
    cell = (cells[:, 1] - low[1]) * columns + cells[:, 0] - low[0]
    order = np.argsort(cell, kind="stable")  # boxes come sorted by (ix, iy, iz), so layers stay in rising order
    return FloorLevel(
        floor_z_m=level_z_m,
        origin_cell=(int(low[0]), int(low[1])),
        shape=(rows, columns),
        first=np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=rows * columns))]).astype(np.int32),
        layers=cells[order, 2].astype(np.int16),
        obstacle=obstacle[order],
    )


def _require_home_size(columns: int, rows: int, level_z_m: float) -> None:
    if columns * rows > MAX_MAP_CELLS:
        raise DataError(
            Reason.MAP_TOO_LARGE,
            f"the map of a floor must have at most {MAX_MAP_CELLS} cells, found {columns} x {rows} "
            f"({columns * CELL_SIZE_M:.0f} m x {rows * CELL_SIZE_M:.0f} m) at {level_z_m} m; are there stray points?",
            {"columns": columns, "rows": rows, "level_z_m": level_z_m},
        )


def save_scene_map(path: Path, scene_map: SceneMap) -> None:
    """Write a map to an .npz file, atomically; equal maps give equal bytes."""
    save_arrays(path, _arrays(scene_map.levels, scene_map.origin))


def load_scene_map(path: Path) -> SceneMap:
    """Read what `save_scene_map` wrote.

    Raises:
        IntegrityError: the file is damaged or holds something else.
    """
    arrays = load_arrays(path, _NAMES)
    try:
        return SceneMap(levels=_split_levels(arrays), origin=str(arrays["origin"]))
    except (ValueError, IndexError) as error:
        raise IntegrityError(f"{path} does not hold a scene map: {error}") from error


def scene_map_digest(scene_map: SceneMap, floor_z_m: float | None = None) -> str:
    """Return the sha256 of a map, in hexadecimal; of the level of one floor where `floor_z_m` is given.

    The digest of a level stays when episodes on another floor of the scene are added.
    """
    levels = scene_map.levels if floor_z_m is None else (scene_map.level_at(floor_z_m),)
    return arrays_digest(_arrays(levels, scene_map.origin))


def _arrays(levels: Sequence[FloorLevel], origin: str) -> dict[str, np.ndarray]:
    return {
        "floor_z_m": np.array([level.floor_z_m for level in levels], np.float64),
        "origin_cell": np.array([level.origin_cell for level in levels], np.int64).reshape(-1, 2),
        "shape": np.array([level.shape for level in levels], np.int64).reshape(-1, 2),
        "first_box": np.concatenate([np.zeros(0, np.int32), *(level.first for level in levels)]),
        "layers": np.concatenate([np.zeros(0, np.int16), *(level.layers for level in levels)]),
        "obstacle": np.concatenate([np.zeros(0, np.bool_), *(level.obstacle for level in levels)]),
        "origin": np.array(origin),
    }


def _split_levels(arrays: dict[str, np.ndarray]) -> tuple[FloorLevel, ...]:
    levels, box, start = [], 0, 0
    for z, cell, shape in zip(arrays["floor_z_m"], arrays["origin_cell"], arrays["shape"], strict=True):
        first = arrays["first_box"][start : start + int(shape[0]) * int(shape[1]) + 1]
        boxes = slice(box, box + int(first[-1]))
        levels.append(
            FloorLevel(
                floor_z_m=float(z),
                origin_cell=(int(cell[0]), int(cell[1])),
                shape=(int(shape[0]), int(shape[1])),
                first=first,
                layers=arrays["layers"][boxes],
                obstacle=arrays["obstacle"][boxes],
            )
        )
        box, start = boxes.stop, start + len(first)
    if box != len(arrays["layers"]) or start != len(arrays["first_box"]):
        raise ValueError(f"{len(arrays['layers']) - box} boxes and {len(arrays['first_box']) - start} cells too many")
    return tuple(levels)
