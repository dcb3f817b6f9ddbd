"""Homes with one difficulty planted on the way, each beside an easy twin: the judge of what a rule calls hard.

A case is a floor plan of `wsm_data.synth` with its furniture, a start and a goal. The twins differ in the planted thing
alone: the width of one door; whether two rooms are joined directly; whether a dead end opens towards the goal or away
from it; whether the same posts stand beside the way or far from it. What is easy is so by construction: the way leads
straight through, and furniture that would stand nearer than 0.6 m to that straight way is left out of both twins. No
score is looked at here. The expert, the map, the geodesic field and the crop are those of `wsm synth` and `wsm encode`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from wsm_data.clips.config import ClipConfig
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_view import view_scene
from wsm_data.curation.scorers.trajectory import Trajectory, map_with
from wsm_data.errors import DataError
from wsm_data.maps.scene_map import SceneMap, build_scene_map
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.surface import CELL_SIZE_M, SurfaceVoxels
from wsm_data.synth.config import CAMERAS
from wsm_data.synth.drive.expert import smooth_way
from wsm_data.synth.drive.occupancy import Clearance
from wsm_data.synth.drive.route_graph import cell_graph, way_to, ways_from
from wsm_data.synth.home.floor_plan import PARTITION_M, FloorPlan, Opening, Room, make_floor_plan, side_of
from wsm_data.synth.home.furnishing import furnish_room
from wsm_data.synth.home.style import choose_style

DATASET = load_dataset("synthetic")
CLEAR_M = 0.6  # furniture keeps this far from the straight way of the easy twin
LEAST_M, COMFORTABLE_M = 0.3, 0.6  # as in SynthConfig: radius and margin of the robot, and what it prefers
HEIGHT_M, PITCH_RAD, STEP_M = 0.5, 0.1, 0.045
FULLNESS = 0.6
TRIES = 60

Rectangle = tuple[float, float, float, float]  # x0, y0, x1, y1, m


@dataclass(frozen=True, kw_only=True)
class Twin:
    """One trajectory of a case."""

    kind: str
    case: int
    hard: bool
    trajectory: Trajectory


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What a twin is made of: rooms and openings, things on the floor, where the way begins and ends."""

    plan: FloorPlan
    things: Sequence[Rectangle]
    start: np.ndarray
    goal: np.ndarray


Planter = Callable[[np.random.Generator, FloorPlan, Sequence[Rectangle]], tuple[Setting, Setting] | None]


def planted_pair(kind: str, case: int, seed: int) -> tuple[Twin, Twin]:
    """The easy and the hard twin of a case; homes are drawn until the difficulty finds a place in one."""
    for attempt in range(TRIES):
        rng = np.random.default_rng([seed, list(KINDS).index(kind), case, attempt])
        plan = make_floor_plan(rng)
        settings = KINDS[kind](rng, plan, furniture_of(rng, plan))
        trajectories = [drive(one) for one in settings] if settings else [None]
        if all(one is not None for one in trajectories):
            easy, hard = (Twin(kind=kind, case=case, hard=bool(i), trajectory=t) for i, t in enumerate(trajectories))
            return easy, hard
    raise RuntimeError(f"no place for {kind} in {TRIES} homes")


def furniture_of(rng: np.random.Generator, plan: FloorPlan) -> list[Rectangle]:
    """Footprints of all furniture that a robot cannot drive over; doors stand open."""
    style = choose_style(rng)
    pieces = [piece for room in plan.rooms for piece in furnish_room(rng, room, plan, style, FULLNESS)]
    return [foot for piece in pieces if piece.height_m > DATASET.robot.ground_clearance_m for foot in piece.footprints]


# The four difficulties. Each returns the settings of the easy and of the hard twin, or None where the plan has no room.


def plant_narrow_door(rng, plan, things):
    """A door on the way is as wide as the plan has it, 0.84 to 0.98 m, or 0.65 to 0.75 m."""
    opening = rng.choice([one for one in plan.openings if one.kind == "door"])
    others = [one for one in plan.openings if one is not opening]
    room_ends = ends_across(rng, plan, opening)
    if room_ends is None:
        return None
    start, goal = room_ends
    narrow = replace(plan, openings=(*others, with_width(opening, float(rng.uniform(0.65, 0.75)))))
    kept = clear_of(things, start, goal)
    return tuple(Setting(plan=one, things=kept, start=start, goal=goal) for one in (plan, narrow))


def plant_detour(rng, plan, things):
    """Neighbouring rooms are joined by a passage, or only by the hall."""
    pairs = [
        (a, b)
        for a in plan.rooms
        for b in plan.rooms
        if shared_wall(a, b) is not None and "hall" not in (a.kind, b.kind)
    ]
    if not pairs:
        return None
    wall = shared_wall(*pairs[int(rng.integers(len(pairs)))])
    passage = with_width(wall, float(rng.uniform(0.9, 1.3)))
    between = [one for one in plan.openings if not same_wall(one, wall)]
    ends = ends_across(rng, plan, passage)
    if ends is None:
        return None
    start, goal = ends
    kept = clear_of(things, start, goal)
    joined, apart = replace(plan, openings=(*between, passage)), replace(plan, openings=tuple(between))
    return tuple(Setting(plan=one, things=kept, start=start, goal=goal) for one in (joined, apart))


def plant_dead_end(rng, plan, things):
    """The way begins between three walls that open towards the goal, or away from it."""
    room = max(plan.rooms, key=lambda one: min(one.x1 - one.x0, one.y1 - one.y0))
    sizes = np.array([room.x1 - room.x0, room.y1 - room.y0])
    along = int(np.argmax(sizes))
    wide, deep, wall = float(rng.uniform(1.2, 1.5)), float(rng.uniform(1.1, 1.5)), 0.1
    if sizes[1 - along] < wide + 2 * (wall + 0.75) or sizes[along] < 4.2:
        return None
    sign = 1 if rng.random() < 0.5 else -1
    centre = np.array([(room.x0 + room.x1) / 2, (room.y0 + room.y1) / 2])
    centre[1 - along] += float(rng.uniform(-0.1, 0.1))
    axis = np.eye(2)[along] * sign
    start = centre - axis * (sizes[along] / 2 - 0.8 - deep / 2)
    goal = centre + axis * (sizes[along] / 2 - 0.6)
    kept = [
        one
        for one in clear_of(things, start, goal)
        if distance_to_way(one, start - axis, start + axis) > 0.9 + wide / 2
    ]
    easy, hard = (pocket(start, facing, wide, deep, wall) for facing in (axis, -axis))
    return tuple(Setting(plan=plan, things=[*kept, *walls], start=start, goal=goal) for walls in (easy, hard))


def plant_clutter(rng, plan, things):
    """Posts stand on both sides of a straight way, or as many elsewhere."""
    room = max(plan.rooms, key=lambda one: one.area_m2)
    low, high = np.array([room.x0, room.y0]) + 0.7, np.array([room.x1, room.y1]) - 0.7
    start, goal = (low + rng.random(2) * (high - low) for _ in range(2))
    length = float(np.hypot(*(goal - start)))
    if length < 2.5:
        return None
    axis = (goal - start) / length
    side = np.array([-axis[1], axis[0]])
    beside = []
    for number, at in enumerate(np.arange(0.5, length - 0.3, float(rng.uniform(0.4, 0.7)))):
        half, gap = float(rng.uniform(0.05, 0.12)), float(rng.uniform(0.34, 0.48))
        beside.append(square(start + at * axis + (-1) ** number * (gap + half) * side, half))
    elsewhere = []
    for one in beside:
        half = (one[2] - one[0]) / 2
        spots = [
            square(np.array([room.x0, room.y0]) + rng.random(2) * (room.x1 - room.x0, room.y1 - room.y0), half)
            for _ in range(40)
        ]
        elsewhere += [spot for spot in spots if distance_to_way(spot, start, goal) > 0.8][:1]
    kept = clear_of(things, start, goal)
    return tuple(Setting(plan=plan, things=[*kept, *posts], start=start, goal=goal) for posts in (elsewhere, beside))


KINDS: dict[str, Planter] = {
    "narrow door": plant_narrow_door,
    "detour": plant_detour,
    "dead end": plant_dead_end,
    "clutter": plant_clutter,
}


def with_width(opening: Opening, width_m: float) -> Opening:
    middle = (opening.start + opening.end) / 2
    return replace(opening, start=middle - width_m / 2, end=middle + width_m / 2)


def same_wall(one: Opening, other: Opening) -> bool:
    overlap = min(one.end, other.end) > max(one.start, other.start)
    return one.axis == other.axis and abs(one.low - other.low) < 1e-6 and overlap


def shared_wall(a: Room, b: Room) -> Opening | None:
    """The partition between two rooms, b beyond a, as an opening of its full length; None if they are apart."""
    for axis in (0, 1):
        a0, a1, a_edge = (a.x0, a.x1, a.y1) if axis == 0 else (a.y0, a.y1, a.x1)
        b0, b1, b_edge = (b.x0, b.x1, b.y0) if axis == 0 else (b.y0, b.y1, b.x0)
        if abs(b_edge - a_edge - PARTITION_M) < 1e-6 and min(a1, b1) - max(a0, b0) > 2.0:
            return Opening(kind="passage", axis=axis, start=max(a0, b0), end=min(a1, b1), low=a_edge, high=b_edge)
    return None


def ends_across(rng, plan: FloorPlan, opening: Opening) -> tuple[np.ndarray, np.ndarray] | None:
    """A start and a goal in front of an opening and behind it, off its middle by up to 0.8 m."""
    ends = []
    for sign, face in ((-1, opening.low), (1, opening.high)):
        rooms = [
            room
            for room in plan.rooms
            if side_of(opening, room) in (("north", "east") if sign < 0 else ("south", "west"))
        ]
        if len(rooms) != 1:
            return None
        depth = rooms[0].y1 - rooms[0].y0 if opening.axis == 0 else rooms[0].x1 - rooms[0].x0
        across = face + sign * min(float(rng.uniform(0.8, 3.0)), depth - 0.4)
        along = (opening.start + opening.end) / 2 + float(rng.uniform(-0.8, 0.8))
        ends.append(np.array([along, across] if opening.axis == 0 else [across, along]))
    return (ends[0], ends[1]) if rng.random() < 0.5 else (ends[1], ends[0])


def pocket(middle, facing, wide, deep, wall) -> list[Rectangle]:
    """Three walls around a point, open towards `facing`."""
    side = np.array([-facing[1], facing[0]])
    corners = [
        (-facing * (deep / 2 + wall) - side * (wide / 2 + wall), -facing * deep / 2 + side * (wide / 2 + wall)),
        (-facing * deep / 2 + side * wide / 2, facing * deep / 2 + side * (wide / 2 + wall)),
        (-facing * deep / 2 - side * wide / 2, facing * deep / 2 - side * (wide / 2 + wall)),
    ]
    return [(*np.minimum(middle + a, middle + b), *np.maximum(middle + a, middle + b)) for a, b in corners]


def square(middle, half) -> Rectangle:
    return (middle[0] - half, middle[1] - half, middle[0] + half, middle[1] + half)


def clear_of(things, start, goal) -> list[Rectangle]:
    return [one for one in things if distance_to_way(one, start, goal) > CLEAR_M]


def distance_to_way(thing: Rectangle, start, goal) -> float:
    """Distance of a rectangle to the straight way between two points, m."""
    points = start + np.linspace(0, 1, 101)[:, None] * (goal - start)
    gaps = np.maximum(np.maximum(np.array(thing[:2]) - points, points - np.array(thing[2:])), 0)
    return float(np.hypot(*gaps.T).min())


def drive(setting: Setting) -> Trajectory | None:
    """The expert's way on the map that `wsm encode` would cut for it; None where there is none."""
    floor, blocked, first = raster(setting)
    clearance = ndimage.distance_transform_edt(floor & ~blocked) * CELL_SIZE_M
    room = Clearance(distance_m=clearance, origin_m=(first[0] * CELL_SIZE_M, first[1] * CELL_SIZE_M))
    graph = cell_graph(room, LEAST_M, COMFORTABLE_M)
    if len(graph.cells) < 2:
        return None
    centres = room.centres(graph.cells)
    nodes = [int(np.argmin(np.hypot(*(centres - end).T))) for end in (setting.start, setting.goal)]
    if any(
        np.hypot(*(centres[node] - end)) > 0.15 for node, end in zip(nodes, (setting.start, setting.goal), strict=True)
    ):
        return None
    _, before = ways_from(graph, nodes[0])
    curve = smooth_way(way_to(graph, before, nodes[1]), room, LEAST_M)
    return None if curve is None else on_map(poses_along(curve), floor, blocked, first)


def raster(setting: Setting) -> tuple[np.ndarray, np.ndarray, tuple[int, int]]:
    """Floor and obstacles on the world's grid: bool [Y, X] each, and the cell of their first column and row."""
    rooms = setting.plan.rooms
    low = np.floor(np.array([min(r.x0 for r in rooms), min(r.y0 for r in rooms)]) / CELL_SIZE_M).astype(int) - 5
    high = np.ceil(np.array([max(r.x1 for r in rooms), max(r.y1 for r in rooms)]) / CELL_SIZE_M).astype(int) + 5
    x, y = ((np.arange(low[k], high[k]) + 0.5) * CELL_SIZE_M for k in range(2))
    floor = np.zeros((len(y), len(x)), bool)
    for one in rooms:
        floor |= inside(x, y, (one.x0, one.y0, one.x1, one.y1))
    for one in setting.plan.openings:
        if one.kind != "window":
            hole = (one.start, one.low, one.end, one.high) if one.axis == 0 else (one.low, one.start, one.high, one.end)
            floor |= inside(x, y, hole)
    blocked = ~floor & ndimage.binary_dilation(floor, np.ones((3, 3)), iterations=2)  # the faces of the walls
    for thing in setting.things:
        blocked |= inside(x, y, thing) & floor
    return floor, blocked, (int(low[0]), int(low[1]))


def inside(x, y, rectangle: Rectangle) -> np.ndarray:
    x0, y0, x1, y1 = rectangle
    return ((y >= y0) & (y < y1))[:, None] & ((x >= x0) & (x < x1))[None, :]


def poses_along(curve: np.ndarray) -> np.ndarray:
    """OpenCV cameras at equal steps along a curve, looking along its tangent; float64 [T, 4, 4]."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    wanted = np.linspace(0, arc[-1], max(2, round(arc[-1] / STEP_M) + 1))
    xy = np.column_stack([np.interp(wanted, arc, curve[:, k]) for k in range(2)])
    heading = np.unwrap(np.arctan2(*np.diff(curve, axis=0).T[::-1]))
    heading = np.interp(wanted, (arc[1:] + arc[:-1]) / 2, ndimage.gaussian_filter1d(heading, 12, mode="nearest"))
    T = np.zeros((len(xy), 4, 4))
    c, s, down, level = np.cos(heading), np.sin(heading), np.sin(PITCH_RAD), np.cos(PITCH_RAD)
    T[:, 0, 0], T[:, 1, 0] = s, -c  # x: to the right
    T[:, :3, 1] = np.column_stack([-c * down, -s * down, np.full(len(c), -level)])  # y: down
    T[:, :3, 2] = np.column_stack([c * level, s * level, np.full(len(c), -down)])  # z: forward
    T[:, :2, 3], T[:, 2, 3], T[:, 3, 3] = xy, HEIGHT_M, 1.0
    return T


def on_map(
    T_world_camera: np.ndarray, floor: np.ndarray, blocked: np.ndarray, first: tuple[int, int]
) -> Trajectory | None:
    names = tuple(str(number) for number in range(len(T_world_camera)))
    record = EpisodeRecord(
        id=EpisodeId("planted_d435i", "home", "000000"),
        container="home",
        rgb_members=names,
        depth_members=names,
        T_world_camera=T_world_camera,
        intrinsics=CAMERAS["d435i"].resized(320, 192),
        camera_height_m=HEIGHT_M,
        camera_pitch_rad=PITCH_RAD,
        frames_digest="",
        content_digest="",
    )
    config = ClipConfig()
    try:
        laid = lay_path(record, scene_map_of(floor, blocked, first), DATASET, config)
        view = view_scene(record, laid, DATASET, config)
    except DataError:
        return None
    return Trajectory(
        T_world_camera=T_world_camera,
        intrinsics=record.intrinsics,
        goal_xy_m=record.path_xy_m[-1],
        goal_radius_m=config.goal_radius_m,
        start_distance_m=float(view.distance_m[0]),
        map=map_with(view.occupancy, record.path_xy_m),
        robot_radius_m=DATASET.robot.radius_m,
    )


def scene_map_of(floor: np.ndarray, blocked: np.ndarray, first: tuple[int, int]) -> SceneMap:
    """A box of floor in every cell with floor, and one at 0.3 m in every cell with an obstacle."""
    boxes = []
    for cells, layer in ((floor & ~blocked, 0), (blocked, 30)):
        row, column = np.nonzero(cells)
        boxes.append(np.column_stack([column + first[0], row + first[1], np.full(len(row), layer)]))
    cells = np.unique(np.concatenate(boxes), axis=0).astype(np.int16)
    voxels = SurfaceVoxels(cells=cells, obstacle=cells[:, 2] > 0, origin="cloud")
    return build_scene_map(voxels, [0.0], DATASET.robot, 2.0)
