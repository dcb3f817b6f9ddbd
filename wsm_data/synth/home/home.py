"""A furnished home: its plan, its surfaces, its light, ready to be rendered and driven through."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.floor_plan import FloorPlan, Room, make_floor_plan
from wsm_data.synth.home.furnishing import furnish_room, threshold
from wsm_data.synth.home.furniture.piece import Piece, Rectangle
from wsm_data.synth.home.lighting import VOXEL_M, bake
from wsm_data.synth.home.mesh import build_mesh
from wsm_data.synth.home.sampling import sample_surface
from wsm_data.synth.home.style import Style, choose_room_style, choose_style
from wsm_data.synth.home.walls import SIDES, opening_surface, room_shell
from wsm_data.synth.render.atlas import paint_atlas
from wsm_data.synth.render.render import RenderMesh
from wsm_data.synth.render.surface import Material, Surface, Texture, join

if TYPE_CHECKING:
    import trimesh

_CHECK_CELL_M = 0.05
_PASSAGE_M = 0.34  # half of the narrowest way that counts when a furnished room is checked, m
_MIN_ROOM_M2 = 0.8
_T_GLTF_WORLD = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])


@dataclass(frozen=True, kw_only=True)
class Home:
    """A physical scene in world coordinates: metres, z up, the floor at z = 0.

    Attributes:
        floor_plan: rooms, doors and windows.
        surface: everything that can be seen or run into.
        mesh: the same, textured and lit, for `render`.
        mean_colour: mean colour of each patch of the surface without light, in [0, 1]; float64 [P, 3].
        floor_patch: whether a patch is floor; bool [P].
    """

    floor_plan: FloorPlan
    surface: Surface
    mesh: RenderMesh
    mean_colour: Float64Array
    floor_patch: BoolArray


def make_home(seed: int, scene_index: int, ground_clearance_m: float = SynthConfig.ground_clearance_m) -> Home:
    """Build scene number `scene_index` of a source; the same arguments give the same home to the bit.

    Furniture no higher than `ground_clearance_m` is driven over, and leaves a room open that it stands in the way of.
    """
    rng_plan, rng_style, rng_rooms, rng_paint = np.random.default_rng([seed, scene_index]).spawn(4)
    plan = make_floor_plan(rng_plan)
    style = choose_style(rng_style)
    furniture = _furnish(rng_rooms, plan, style, ground_clearance_m)
    shell = _shell(rng_style, plan, style)
    parts = [*shell, *(item.surface for item in furniture)]
    surface = join(parts)
    lamps = tuple(lamp for item in furniture for lamp in item.lamps)
    atlas = paint_atlas(rng_paint, set(surface.texture.tolist()))
    light = bake(surface, sample_surface(surface, 0.8 * VOXEL_M)[0], plan, lamps)
    return Home(
        floor_plan=plan,
        surface=surface,
        mesh=build_mesh(surface, [len(part) for part in parts], atlas, light),
        mean_colour=np.clip(surface.tint * atlas.mean[surface.texture], 0.0, 1.0),
        floor_patch=_floor_patches(surface),
    )


def _shell(rng: np.random.Generator, plan: FloorPlan, style: Style) -> list[Surface]:
    """Shells of all rooms, and what is in their openings."""
    parts = []
    looks = [choose_room_style(rng, room, style, number) for number, room in enumerate(plan.rooms)]
    for room, look in zip(plan.rooms, looks, strict=True):
        parts.append(room_shell(room, plan, look, style, str(rng.choice(SIDES))))
    wood = Material(texture=Texture.WOOD, tint=style.scheme.dark, repeat_m=0.6)
    view = Texture.VIEW_GARDEN if rng.random() < 0.6 else Texture.VIEW_TOWN
    return parts + [opening_surface(opening, plan.rooms, style, wood, view) for opening in plan.openings]


def _floor_patches(surface: Surface) -> BoolArray:
    """Patches in the floor's plane that face up: floors and thresholds, not rugs."""
    flat = (surface.points_m[..., 2] == 0.0).all(axis=1)
    return np.asarray(flat & surface.quad & (surface.normals[:, 0, 2] > 0.5))


def _furnish(rng: np.random.Generator, plan: FloorPlan, style: Style, ground_clearance_m: float) -> list[Piece]:
    """Furnish every room so that each can be entered; a room that is too full is done again with less in it."""
    streams = rng.spawn(len(plan.rooms))
    rooms: list[list[Piece]] = [furnish_room(streams[i], room, plan, style, 1.0) for i, room in enumerate(plan.rooms)]
    for fullness in (0.8, 0.6, 0.4, 0.0):
        obstacles = [item for pieces in rooms for item in pieces if item.height_m > ground_clearance_m]
        blocked = _blocked_rooms(plan, obstacles)
        for i in blocked:
            rooms[i] = furnish_room(streams[i], plan.rooms[i], plan, style, fullness)
    return [item for pieces in rooms for item in pieces]


def _blocked_rooms(plan: FloorPlan, obstacles: Sequence[Piece]) -> list[int]:
    """Rooms of which a robot that comes from the others reaches less than a little floor; by footprints alone."""
    x0, y0 = min(r.x0 for r in plan.rooms), min(r.y0 for r in plan.rooms)
    size = (max(r.y1 for r in plan.rooms) - y0, max(r.x1 for r in plan.rooms) - x0)
    free = np.zeros([int(np.ceil(length / _CHECK_CELL_M)) + 2 for length in size], np.bool_)

    def window(r: Rectangle) -> tuple[slice, slice]:
        cells = np.round((np.array(r) - (x0, y0, x0, y0)) / _CHECK_CELL_M).astype(int) + 1
        return slice(max(cells[1], 0), max(cells[3], 0)), slice(max(cells[0], 0), max(cells[2], 0))

    for room in plan.rooms:
        free[window((room.x0, room.y0, room.x1, room.y1))] = True
    for opening in plan.openings:
        if opening.kind != "window":
            free[window(threshold(opening))] = True
    for item in obstacles:
        for footprint in item.footprints:
            free[window(footprint)] = False
    passable = ndimage.distance_transform_edt(free) * _CHECK_CELL_M > _PASSAGE_M
    labels, count = ndimage.label(passable)
    largest = int(np.argmax(np.bincount(labels.ravel())[1:])) + 1 if count else -1
    reached = [(labels[window((r.x0, r.y0, r.x1, r.y1))] == largest).sum() * _CHECK_CELL_M**2 for r in plan.rooms]
    return [i for i, area in enumerate(reached) if area < _MIN_ROOM_M2]


def home_trimesh(home: Home) -> "trimesh.Trimesh":
    """The home as one trimesh, z up, m; faces carry the mean colour of their texture."""
    import trimesh

    points = home.mesh.points_m
    faces = np.arange(3 * len(points)).reshape(-1, 3)
    patch: NDArray[np.int64] = np.repeat(np.arange(len(home.surface)), np.where(home.surface.quad, 2, 1))
    colours = np.round(255 * home.mean_colour[patch]).astype(np.uint8)
    return trimesh.Trimesh(vertices=points.reshape(-1, 3), faces=faces, face_colors=colours, process=False)


def home_glb(home: Home) -> bytes:
    """The home as a binary glTF that any viewer shows: vertices in world coordinates, m, colours without light.

    glTF's own up is y. The vertices stay in the world's axes, z up, and the node that holds them turns them.
    """
    import trimesh

    scene = trimesh.Scene()
    scene.add_geometry(home_trimesh(home), node_name="home", geom_name="home", transform=_T_GLTF_WORLD)
    return bytes(scene.export(file_type="glb"))


def room_at(plan: FloorPlan, xy_m: tuple[float, float]) -> Room | None:
    """The room a point is in; None in a doorway or outside."""
    x, y = xy_m
    return next((room for room in plan.rooms if room.x0 <= x <= room.x1 and room.y0 <= y <= room.y1), None)
