import numpy as np

from wsm_data.synth.home.furniture import bath
from wsm_data.synth.render.surface import Texture


def test_sanitary_ware_stands_on_its_footprint(style, stands_on_its_footprint):
    for item in (bath.bathtub(style), bath.shower(style), bath.toilet()):
        stands_on_its_footprint(item)


def test_a_tub_is_open_above_its_water(style):
    tub = bath.bathtub(style)
    points = tub.surface.points_m
    inner = (np.abs(points[..., 0]).max(axis=1) < 0.7) & (points[..., 1].min(axis=1) > 0.1)
    assert points[inner & (points[..., 1].max(axis=1) < 0.6), :, 2].max(initial=0.0) < 0.5


def test_a_basin_has_a_mirror_above_it_and_hangs_off_the_floor(style):
    basin = bath.basin(np.random.default_rng(0), style)
    mirror = basin.surface.points_m[basin.surface.texture == Texture.MIRROR]
    assert mirror[..., 2].min() > 1.0
    assert basin.surface.points_m[..., 2].min() > 0.15


def test_a_towel_rail_keeps_to_the_wall(style):
    assert bath.towel_rail(style).surface.points_m[..., 1].max() < 0.12
