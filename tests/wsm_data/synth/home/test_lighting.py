import numpy as np
import pytest

from wsm_data.synth.home.floor_plan import FloorPlan, Room
from wsm_data.synth.home.furniture.piece import Lamp
from wsm_data.synth.home.lighting import bake
from wsm_data.synth.home.sampling import sample_surface
from wsm_data.synth.home.solids import block
from wsm_data.synth.render.surface import Material, join, panel, parallelogram

ROOM = Room(kind="study", x0=0, y0=0, x1=4, y1=4)
DARK = FloorPlan(rooms=(ROOM,), openings=(), ceiling_m=2.5)
LAMP = Lamp(xyz_m=(2.0, 2.0, 2.2), power=(2.0, 1.0, 0.5), radius_m=0.05)
FLOOR = panel((0, 0, 0), (4, 0, 0), (0, 4, 0), Material())
WALL = panel((0, 4, 0), (4, 0, 0), (0, 0, 2.5), Material())
TABLE = block((2, 2), 0.8, (1, 1, 0.05), Material())


def light_of(*parts, lamps=(LAMP,)):
    surface = join(parts)
    return surface, bake(surface, sample_surface(surface, 0.04)[0], DARK, lamps)


def grid(light, patch: int) -> np.ndarray:
    """Light of a patch as rows (along edge v) and columns (along edge u)."""
    first, columns, rows = light.patch[patch].tolist()
    return light.samples[first : first + rows * columns].reshape(rows, columns, 3)


def test_the_floor_is_lightest_under_the_lamp_and_has_its_colour():
    _, light = light_of(FLOOR)
    floor = grid(light, 0)
    brightest = np.unravel_index(floor[..., 0].argmax(), floor.shape[:2])
    assert np.abs(np.array(brightest) - np.array(floor.shape[:2]) / 2).max() < 2
    assert floor[brightest][0] > floor[brightest][1] > floor[brightest][2]


def test_a_table_casts_its_shadow():
    floor = grid(light_of(FLOOR)[1], 0)
    shaded = grid(light_of(FLOOR, TABLE)[1], 0)
    middle = floor.shape[0] // 2
    assert shaded[middle, middle, 0] < 0.7 * floor[middle, middle, 0]
    assert shaded[1, 1] == pytest.approx(floor[1, 1], rel=0.1)


def test_corners_are_darker_than_open_floor_even_without_a_lamp():
    floor = grid(light_of(FLOOR, WALL, lamps=(Lamp(xyz_m=(2, 2, 2), power=(0, 0, 0)),))[1], 0)
    assert floor[-1, 15, 0] < 0.97 * floor[8, 15, 0]


def test_what_shines_itself_shows_its_tint_whatever_the_light():
    glow = parallelogram((0, 0, 1), (1, 0, 0), (0, 1, 0), Material(emission=1.0, tint=(1.2, 0.5, 0.1)))
    assert np.abs(grid(light_of(glow)[1], 0) - (1.2, 0.5, 0.1)).max() < 1e-12


def test_light_is_straight_over_a_triangle():
    surface = join([FLOOR, TABLE])
    triangle = surface.__class__(**{**{k: v[:1] for k, v in vars(FLOOR).items()}, "quad": np.array([False])})
    nodes = grid(light_of(triangle)[1], 0)
    assert nodes.shape == (2, 2, 3)
    assert nodes[1, 1] == pytest.approx(np.maximum(nodes[0, 1] + nodes[1, 0] - nodes[0, 0], 0))


def test_nodes_are_no_farther_apart_than_the_spacing():
    surface, light = light_of(FLOOR, WALL)
    edges = np.linalg.norm(surface.points_m[:, 1:] - surface.points_m[:, :1], axis=-1)
    assert (edges / (light.patch[:, 1:] - 1) <= 0.14 + 1e-9).all()
