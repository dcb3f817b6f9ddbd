import numpy as np
import pytest

from wsm_data.synth.home.solids import block, box, cushion, lathe, sheet, tube
from wsm_data.synth.render.surface import Material, Surface

PLAIN = Material()


def corners(surface: Surface) -> np.ndarray:
    """Triangles [F, 3, 3] of a surface."""
    a, b, d = (surface.points_m[:, k] for k in range(3))
    first = np.where(surface.quad[:, None, None], np.stack([a, b, b + d - a], 1), np.stack([a, b, d], 1))
    second = np.stack([a, b + d - a, d], 1)[surface.quad]
    return np.concatenate([first, second])


def volume(surface: Surface) -> float:
    """Enclosed volume by the divergence theorem: positive when all faces show outwards."""
    t = corners(surface)
    return float((t[:, 0] * np.cross(t[:, 1], t[:, 2])).sum() / 6)


def test_a_box_encloses_its_volume_and_shows_outwards():
    assert volume(box((1, 2, 3), (2, 4, 6), PLAIN)) == pytest.approx(6)


def test_skipped_faces_are_left_out():
    assert len(box((0, 0, 0), (1, 1, 1), PLAIN, skip=("-z", "+y"))) == 4


def test_a_block_stands_on_its_height_around_its_centre():
    points = corners(block((1, 2), 0.5, (2, 4, 1), PLAIN)).reshape(-1, 3)
    assert points.min(axis=0).tolist() == [0, 0, 0.5]
    assert points.max(axis=0).tolist() == [2, 4, 1.5]


def test_a_lathed_cylinder_has_the_volume_of_its_polygon():
    solid = lathe([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 2.0), (1.0, 2.0), (0.0, 2.0)], PLAIN, sides=12)
    assert volume(solid) == pytest.approx(2 * 12 * np.sin(2 * np.pi / 12) / 2)


def test_a_round_cushion_is_nearly_an_ellipsoid_inside_its_box():
    solid = cushion((0, 0, 1), (2, 4, 2), PLAIN, squareness=1.0, rings=24, sides=48)
    assert volume(solid) == pytest.approx(4 / 3 * np.pi * 1 * 2 * 1, rel=0.02)  # an inscribed polyhedron is smaller
    assert np.abs(solid.points_m - (0, 0, 1)).max(axis=(0, 1)) == pytest.approx([1, 2, 1])


def test_a_square_cushion_nearly_fills_its_box():
    assert volume(cushion((0, 0, 0), (2, 2, 2), PLAIN, squareness=0.1, rings=12, sides=24)) > 0.9 * 8


@pytest.mark.parametrize("end", [(0, 0, 2), (1, 1, 1), (-3, 0.1, 0)])
def test_the_sides_of_a_tube_stand_off_its_axis_by_its_radius_and_show_outwards(end):
    bar = tube((0, 0, 0), end, 0.1, PLAIN)
    axis = np.array(end) / np.linalg.norm(end)
    points = bar.points_m.reshape(-1, 3)
    off_axis = points - (points @ axis)[:, None] * axis
    assert np.linalg.norm(off_axis, axis=1) == pytest.approx(np.full(len(points), 0.1))
    assert (bar.normals.reshape(-1, 3) * off_axis).sum(axis=1) == pytest.approx(np.full(len(points), 0.1))


def test_round_bodies_have_unit_normals_on_the_side_their_triangles_show():
    for solid in (cushion((0, 0, 0), (1, 2, 1), PLAIN), lathe([(0.2, 0.0), (0.5, 1.0), (0.1, 1.5)], PLAIN)):
        points = solid.points_m
        facing = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        assert np.linalg.norm(solid.normals, axis=-1) == pytest.approx(np.ones(solid.normals.shape[:2]))
        assert (solid.normals.mean(axis=1) * facing).sum(axis=1).min() > 0


def test_a_flat_sheet_has_its_area_and_faces_s_cross_t():
    flat = sheet(lambda s, t: (2 * s, 3 * t, 0 * s), (4, 5), PLAIN)
    t = flat.points_m
    area = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])[:, 2] / 2
    assert area.sum() == pytest.approx(6)
    assert flat.normals[..., 2] == pytest.approx(np.ones(flat.normals.shape[:2]))
