import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.synth.home.sampling import sample_surface
from wsm_data.synth.home.solids import box, cushion
from wsm_data.synth.render.surface import Material, join, parallelogram


@given(st.floats(0.01, 3.0), st.floats(0.01, 3.0), st.floats(0.05, 0.5))
def test_a_rectangle_is_covered_up_to_its_edges_with_no_wider_gaps(width, depth, spacing):
    points, patch = sample_surface(parallelogram((1, 2, 3), (width, 0, 0), (0, depth, 0), Material()), spacing)
    for axis, (low, length) in enumerate(((1, width), (2, depth))):
        along = np.unique(np.round(points[:, axis], 9))
        assert along[[0, -1]] == pytest.approx([low, low + length], abs=1e-8)
        assert np.diff(along).max() <= spacing + 1e-8
    assert (points[:, 2] == 3).all()
    assert (patch == 0).all()


def test_points_on_triangles_are_on_them():
    solid = cushion((0, 0, 0), (1, 1, 1), Material())
    points, patch = sample_surface(solid, 0.02)
    a, b, d = (solid.points_m[patch, k] for k in range(3))
    normal = np.cross(b - a, d - a)
    st_ = np.stack(
        [
            (np.cross(points - a, d - a) * normal).sum(axis=1) / (normal * normal).sum(axis=1),
            (np.cross(b - a, points - a) * normal).sum(axis=1) / (normal * normal).sum(axis=1),
        ]
    )
    assert np.abs(((points - a) * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)).max() < 1e-12
    assert st_.min() > -1e-9
    assert st_.sum(axis=0).max() < 1 + 1e-9


def test_every_patch_gets_points_and_only_chosen_ones_when_asked():
    solid = join([box((0, 0, 0), (1, 1, 1), Material()), cushion((3, 0, 0), (0.01, 0.01, 0.01), Material())])
    assert set(sample_surface(solid, 0.5)[1]) == set(range(len(solid)))
    chosen = np.arange(len(solid)) == 2
    points, patch = sample_surface(solid, 0.5, chosen)
    assert set(patch) == {2}
    assert len(points) == 9
