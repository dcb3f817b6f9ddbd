"""Starts and goals: the public files of them, and new ones of the same distribution."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_bytes
from wsm_data.maps.footprint import traversable
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import OccupancyGrid

COLUMNS = ("start_x", "start_y", "goal_x", "goal_y", "yaw")

_SHORTEST_M, _LONGEST_M = 4.0, 13.61
_DISTANCE_SHAPE, _DISTANCE_SCALE_M = 1.19, 2.055
"""Distances beyond 4 m follow a Weibull law: median 5.51 m and mean 5.94 m, as in the public home set."""

_BEARING_QUANTILES = ((0.0, 0.5, 0.865, 0.9, 1.0), (0.0, 31.0, 90.0, 101.0, 180.0))
"""Share of goals, and the bearing (degrees) below which so many lie: public home set, 13.5 % behind the robot."""

_PAIRS = 400


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One row of a file: where the robot starts, and where it shall go; world, m and rad."""

    start_pose: Float64Array
    goal_xy_m: Float64Array

    @property
    def straight_m(self) -> float:
        """Straight distance from start to goal, m."""
        return float(np.linalg.norm(self.goal_xy_m - self.start_pose[:2]))


def read_episodes(path: Path) -> tuple[Episode, ...]:
    """Read the public format: float64 [N, 5] of start_x, start_y, goal_x, goal_y, yaw.

    Raises:
        ConfigError: there is no such file.
        IntegrityError: it holds something else.
    """
    try:
        rows = np.lib.format.read_array(io.BytesIO(path.read_bytes()), allow_pickle=False)
    except FileNotFoundError as error:
        raise ConfigError(f"there are no episodes at {path}") from error
    except (ValueError, EOFError, OSError) as error:
        raise IntegrityError(f"{path} must be a .npy file of numbers, but: {error}") from error
    if rows.dtype != np.float64 or rows.ndim != 2 or rows.shape[1] != len(COLUMNS) or not np.isfinite(rows).all():
        raise IntegrityError(
            f"{path} must hold finite float64 [N, 5] ({', '.join(COLUMNS)}), found {rows.dtype} {list(rows.shape)}"
        )
    return tuple(Episode(start_pose=row[[0, 1, 4]], goal_xy_m=row[2:4]) for row in rows)


def write_episodes(path: Path, episodes: tuple[Episode, ...]) -> None:
    """Write the public format, atomically."""
    rows = np.array([[*one.start_pose[:2], *one.goal_xy_m, one.start_pose[2]] for one in episodes], np.float64)
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, rows.reshape(-1, len(COLUMNS)), version=(1, 0), allow_pickle=False)
    write_bytes(path, buffer.getvalue())


def make_episodes(grid: OccupancyGrid, count: int, clearance_m: float, seed: int) -> tuple[Episode, ...]:
    """Episodes in the largest connected free part of a map, distributed as the public home set is.

    A distance is drawn, and of 400 random pairs the one that is nearest to it is taken; then a bearing of the goal.

    Args:
        grid: the map.
        count: how many.
        clearance_m: how far start and goal are from obstacles, m.
        seed: they follow from it and the map.

    Raises:
        ConfigError: the map has no two free places 4 m apart.
    """
    rng = np.random.default_rng(seed)
    places = _largest_part(grid, clearance_m)
    return tuple(_draw(places, rng) for _ in range(count))


def _largest_part(grid: OccupancyGrid, clearance_m: float) -> Float64Array:
    labels, parts = ndimage.label(traversable(grid, clearance_m))
    sizes = np.bincount(labels.ravel(), minlength=2)
    sizes[0] = 0
    rows, columns = np.nonzero(labels == int(np.argmax(sizes))) if parts else (np.zeros(0), np.zeros(0))
    return grid.cell_centres_xy_m(np.column_stack([columns, rows]).astype(np.float64))


def _draw(places_m: Float64Array, rng: np.random.Generator) -> Episode:
    wanted = min(_SHORTEST_M + _DISTANCE_SCALE_M * rng.weibull(_DISTANCE_SHAPE), _LONGEST_M)
    pairs = places_m[rng.integers(len(places_m), size=(_PAIRS, 2))] if len(places_m) else np.zeros((0, 2, 2))
    distance = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=-1)
    far = np.flatnonzero(distance >= _SHORTEST_M)
    if not len(far):
        raise ConfigError(
            f"episodes need two free places {_SHORTEST_M} m apart in one connected part of the map, found none among "
            f"{_PAIRS} pairs of {len(places_m)} places; take a larger scene"
        )
    start, goal = pairs[far[np.argmin(np.abs(distance[far] - wanted))]]
    quantiles, bearings_deg = _BEARING_QUANTILES
    bearing = np.radians(np.interp(rng.random(), quantiles, bearings_deg)) * rng.choice([-1.0, 1.0])
    heading = np.arctan2(goal[1] - start[1], goal[0] - start[0]) - bearing
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    return Episode(start_pose=np.array([*start, wrapped]), goal_xy_m=goal)
