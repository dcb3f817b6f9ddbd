import numpy as np
import pytest

from wsm_data.synth.render.surface import Material, Texture, join, panel, parallelogram, placed

WOOD = Material(texture=Texture.WOOD, repeat_m=0.5, tint=(0.5, 0.6, 0.7))


def test_a_parallelogram_faces_along_the_cross_product_of_its_edges():
    floor = parallelogram((1, 2, 0), (2, 0, 0), (0, 3, 0), WOOD)
    assert floor.normals.tolist() == [[[0, 0, 1]] * 3]
    assert floor.points_m.tolist() == [[[1, 2, 0], [3, 2, 0], [1, 5, 0]]]


def test_grain_follows_the_longer_edge_unless_the_panel_is_upright():
    tall = parallelogram((0, 0, 0), (1, 0, 0), (0, 0, 2), WOOD)
    along_edges = np.abs(tall.uv[0, 1:] - tall.uv[0, :1])
    assert along_edges.tolist() == [[0, 2], [4, 0]]  # repeats: u runs up the long edge
    wall = panel((0, 0, 0), (1, 0, 0), (0, 0, 2), WOOD)
    assert (wall.uv[0, 1:] - wall.uv[0, :1]).tolist() == [[2, 0], [0, -4]]


def test_textures_go_on_across_neighbours_in_one_plane():
    left = panel((0.3, 0, 0), (0.9, 0, 0), (0, 0, 2), WOOD)
    right = panel((1.2, 0, 0), (0.5, 0, 0), (0, 0, 2), WOOD)
    assert left.uv[0, 1] == pytest.approx(right.uv[0, 0], abs=1e-12)


def test_a_fitted_texture_covers_the_patch_once_with_its_top_at_the_upper_edge():
    picture = parallelogram((0, 0, 1), (2, 0, 0), (0, 0, 1), WOOD, fit=True)
    assert picture.uv.tolist() == [[[0, 1], [1, 1], [0, 0]]]


def test_placing_turns_about_z_and_keeps_quarter_turns_exact():
    turned = placed(parallelogram((0, 0, 0.5), (1, 0, 0), (0, 0, 1), WOOD), (5, 6, 0), np.pi / 2)
    assert turned.points_m.tolist() == [[[5, 6, 0.5], [5, 7, 0.5], [5, 6, 1.5]]]
    assert turned.normals[0, 0].tolist() == [1, 0, 0]


def test_joining_keeps_every_patch_in_order():
    a, b = (parallelogram((i, 0, 0), (1, 0, 0), (0, 1, 0), Material(emission=i)) for i in (0.0, 1.0))
    assert join([a, b, a]).emission.tolist() == [0, 1, 0]
