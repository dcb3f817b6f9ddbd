import numpy as np
import pytest

from wsm_data.synth.home.furniture.piece import Lamp, group, move, piece
from wsm_data.synth.home.solids import block
from wsm_data.synth.render.surface import Material

LAMP = Lamp(xyz_m=(0.1, 0.2, 1.0), power=(1, 1, 1))


def crate(*lamps: Lamp):
    return piece([block((0, 0.25), 0, (1.0, 0.5, 0.6), Material())], 1.0, 0.5, 0.6, *lamps)


def test_a_piece_stands_before_its_back():
    assert crate().footprints == ((-0.5, 0.0, 0.5, 0.5),)


def test_moving_takes_footprint_surface_and_lamps_along():
    moved = move(crate(LAMP), (3.0, 1.0), np.pi / 2)
    assert moved.footprints[0] == pytest.approx((2.5, 0.5, 3.0, 1.5))
    assert moved.lamps[0].xyz_m == pytest.approx((2.8, 1.1, 1.0))
    points = moved.surface.points_m.reshape(-1, 3)
    assert points.min(axis=0) == pytest.approx((2.5, 0.5, 0.0))


def test_a_slanting_piece_takes_the_bounds_of_its_turned_footprint():
    x0, y0, x1, y1 = move(crate(), (0.0, 0.0), np.pi / 4).footprints[0]
    assert x1 - x0 == pytest.approx((1.0 + 0.5) / np.sqrt(2))
    assert y1 - y0 == pytest.approx((1.0 + 0.5) / np.sqrt(2))


def test_a_group_is_all_of_its_pieces():
    both = group([crate(LAMP), move(crate(LAMP), (2.0, 0.0), 0.0, z_m=0.5)])
    assert len(both.surface) == 12
    assert len(both.footprints) == len(both.lamps) == 2
    assert both.height_m == 0.6
