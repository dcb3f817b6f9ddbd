"""The expert: smooth ways through a home, and the camera that is carried along them.

As the generator of InternData-N1 is described on its data set card and by its maintainers in public issues: planning at
0.05 m with clearance, waypoints every 0.2 m, cubic splines through them, camera yaw along the tangent, one mount height
and pitch per episode.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from wsm_data.errors import ConfigError
from wsm_data.geometry.camera import T_OPENGL_OPENCV
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.drive.occupancy import Clearance, SceneColumns, clearance
from wsm_data.synth.drive.route_graph import CellGraph, cell_graph, way_to, ways_from
from wsm_data.synth.home.home import Home, room_at

WAYPOINT_M = 0.2
_YAW_SMOOTHING_M = 0.12
_FINE_M = 0.01
_TRIES = 60


@dataclass(frozen=True, kw_only=True)
class Episode:
    """A planned recording of T frames.

    Attributes:
        T_world_opengl: camera to world as it is stored, camera x right, y up, z backward, m; float32 [T, 4, 4].
        camera_height_m: height of the camera above the floor, m.
        camera_pitch_rad: pitch down from the horizontal, rad.
    """

    T_world_opengl: Float32Array
    camera_height_m: float
    camera_pitch_rad: float

    @property
    def T_world_camera(self) -> Float64Array:
        """OpenCV camera to world, of exactly what is stored; float64 [T, 4, 4]."""
        return self.T_world_opengl.astype(np.float64) @ T_OPENGL_OPENCV

    @property
    def T_base_camera(self) -> Float32Array:
        """The mount: rotation about x by (90 deg - pitch down), translation z = camera height; float32 [4, 4]."""
        return _pose(0.0, 0.0, self.camera_height_m, 0.0, self.camera_pitch_rad).astype(np.float32)


def plan_episode(home: Home, columns: SceneColumns, rng: np.random.Generator, config: SynthConfig) -> Episode:
    """Choose a mount, a start and a goal, and the frames between them.

    Args:
        home: where to drive.
        columns: its surfaces, from `scene_columns`.
        rng: source of randomness.
        config: sizes of the robot, lengths of the way.

    Raises:
        ConfigError: no way of the wanted length was found in many attempts.
    """
    for _ in range(_TRIES):
        height = float(np.float32(rng.uniform(config.min_camera_height_m, config.max_camera_height_m)))
        pitch = float(rng.uniform(0.0, np.radians(config.max_pitch_deg)))
        room = clearance(columns, height, config)
        least = config.robot_radius_m + config.planning_margin_m
        graph = cell_graph(room, least, config.comfortable_clearance_m)
        path = _drive(home, graph, rng, config, least) if len(graph.cells) > 1 else None
        if path is not None:
            positions, yaw = path
            poses = [_pose(x, y, height, angle, pitch) for (x, y), angle in zip(positions, yaw, strict=True)]
            stored = np.stack(poses).astype(np.float32)
            return Episode(T_world_opengl=stored, camera_height_m=height, camera_pitch_rad=pitch)
    raise ConfigError(
        f"no way of {config.min_frames} to {config.max_frames} frames in steps of {config.min_step_m} to "
        f"{config.max_step_m} m was found in this home; ask for shorter ways or a smaller robot"
    )


def _drive(
    home: Home, graph: CellGraph, rng: np.random.Generator, config: SynthConfig, least_m: float
) -> tuple[Float64Array, Float64Array] | None:
    """Positions [T, 2] and yaws [T] of one drive, or None where this start offers none."""
    start = int(rng.integers(len(graph.cells)))
    cost, before = ways_from(graph, start)
    goal = _choose_goal(home, graph, cost, start, rng, config)
    if goal is None:
        return None
    curve = smooth_way(way_to(graph, before, goal), graph.clearance, least_m)
    if curve is None:
        return None
    length = float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())
    step = float(rng.uniform(config.min_step_m, config.max_step_m))
    frames = int(np.clip(round(length / step) + 1, config.min_frames, config.max_frames))
    if not config.min_step_m <= length / (frames - 1) <= config.max_step_m:
        return None
    return _resampled(curve, frames)


def _choose_goal(
    home: Home, graph: CellGraph, cost: Float64Array, start: int, rng: np.random.Generator, config: SynthConfig
) -> int | None:
    """A node at a way's length, in another room if there is any; lengths are guessed from straight distance."""
    shortest, longest = (config.min_frames - 1) * config.min_step_m, (config.max_frames - 1) * config.max_step_m
    centres = graph.clearance.centres(graph.cells)
    straight = np.linalg.norm(centres - centres[start], axis=1)
    wanted = float(rng.uniform(0.6, 1.0)) * min(longest, float(straight.max()))
    fits = np.isfinite(cost) & (cost >= shortest) & (straight > 0.6 * shortest) & (straight < wanted)
    candidates = np.flatnonzero(fits & (straight > 0.5 * wanted))
    if not len(candidates):
        candidates = np.flatnonzero(fits)
    if not len(candidates):
        return None
    chosen = rng.choice(candidates, size=min(8, len(candidates)), replace=False)
    here = room_at(home.floor_plan, (float(centres[start, 0]), float(centres[start, 1])))
    elsewhere = [
        c for c in chosen if room_at(home.floor_plan, (float(centres[c, 0]), float(centres[c, 1]))) is not here
    ]
    return int(elsewhere[0] if elsewhere else chosen[0])


def smooth_way(cells_m: Float64Array, room: Clearance, least_m: float) -> Float64Array | None:
    """A cubic spline through waypoints every 0.2 m of a way over cells [N, 2], as dense points [M, 2].

    The waypoints are smoothed as far as the spline stays clear; None where not even the way itself makes a clear one.
    """
    fine = _evenly(cells_m, _FINE_M)
    if len(fine) < 4:
        return None
    for smoothing_m in (0.6, 0.4, 0.25, 0.12):
        smooth = gaussian_filter1d(fine, smoothing_m / _FINE_M, axis=0, mode="nearest")
        blend = _hold_ends(len(fine), smoothing_m / _FINE_M)
        curve = _spline(_evenly(fine + blend[:, None] * (smooth - fine), WAYPOINT_M))
        if float(room.at(curve).min()) >= least_m:
            return curve
    return None


def _hold_ends(count: int, width: float) -> Float64Array:
    """Weight that lets the smoothing set in gently behind the start and before the goal."""
    along = np.minimum(np.arange(count), np.arange(count)[::-1]) / max(1.0, 1.5 * width)
    clipped = np.clip(along, 0.0, 1.0)
    return clipped * clipped * (3 - 2 * clipped)


def _evenly(points: Float64Array, spacing_m: float) -> Float64Array:
    """Points along a polyline, its ends included, about `spacing_m` apart."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(2, round(float(arc[-1]) / spacing_m) + 1)
    wanted = np.linspace(0.0, arc[-1], count)
    return np.column_stack([np.interp(wanted, arc, points[:, k]) for k in range(2)])


def _spline(waypoints: Float64Array) -> Float64Array:
    """Dense points of the natural cubic spline through waypoints."""
    knots = np.arange(len(waypoints), dtype=np.float64)
    dense = np.linspace(0.0, knots[-1], max(2, int(knots[-1] * WAYPOINT_M / _FINE_M)) + 1)
    return np.asarray(CubicSpline(knots, waypoints, bc_type="natural")(dense))


def _resampled(curve: Float64Array, frames: int) -> tuple[Float64Array, Float64Array]:
    """Frames at equal steps along a dense curve, and the direction of its tangent at each, smoothed a little."""
    step = np.diff(curve, axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    heading = gaussian_filter1d(heading, _YAW_SMOOTHING_M / _FINE_M, mode="nearest")
    wanted = np.linspace(0.0, arc[-1], frames)
    positions = np.column_stack([np.interp(wanted, arc, curve[:, k]) for k in range(2)])
    return positions, np.interp(wanted, 0.5 * (arc[1:] + arc[:-1]), heading) - np.pi / 2


def _pose(x: float, y: float, z: float, yaw: float, pitch: float) -> Float64Array:
    """OpenGL camera to world: Rz(yaw) Rx(90 deg - pitch); at yaw 0 it looks along world +y."""
    c, s = np.cos(yaw), np.sin(yaw)
    up, out = np.sin(pitch), np.cos(pitch)  # cos and sin of 90 deg - pitch
    return np.array(
        [
            [c, -s * up, s * out, x],
            [s, c * up, -c * out, y],
            [0.0, out, up, z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
