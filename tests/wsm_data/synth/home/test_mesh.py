import numpy as np
import pytest

from wsm_data.synth.home.lighting import LightGrid
from wsm_data.synth.home.mesh import build_mesh
from wsm_data.synth.home.solids import box, cushion
from wsm_data.synth.render.atlas import paint_atlas
from wsm_data.synth.render.surface import Material, Texture, join


@pytest.fixture(scope="module")
def parts():
    leaf = Material(texture=Texture.LEAF, repeat_m=0.3, two_sided=True)
    return [box((0, 0, 0), (1, 2, 3), Material()), cushion((5, 5, 5), (1, 1, 1), leaf)]


@pytest.fixture(scope="module")
def mesh(parts):
    surface = join(parts)
    patch = np.column_stack([4 * np.arange(len(surface)), np.full((len(surface), 2), 2)])
    light = LightGrid(samples=np.full((4 * len(surface), 3), 0.5), patch=patch)
    atlas = paint_atlas(np.random.default_rng(0), {Texture.LEAF})
    return build_mesh(surface, [len(part) for part in parts], atlas, light)


def test_a_parallelogram_becomes_two_triangles_and_the_volume_is_kept(mesh):
    t = mesh.points_m[: mesh.cluster_start[1]]
    assert len(t) == 12
    assert (t[:, 0] * np.cross(t[:, 1], t[:, 2])).sum() / 6 == pytest.approx(6)


def test_texture_coordinates_are_texels_and_never_negative(mesh, parts):
    assert mesh.uv_texel.min() >= 0
    edge = np.linalg.norm(mesh.points_m[-1, 1] - mesh.points_m[-1, 0])
    texels = np.linalg.norm(mesh.uv_texel[-1, 1] - mesh.uv_texel[-1, 0])
    assert texels <= edge / 0.3 * 64 + 1e-9  # 64 texels a side, one repeat every 0.3 m
    assert texels > 0


def test_light_is_stored_in_fractions_of_512(mesh):
    assert (mesh.light == (256 | 256 << 16 | 256 << 32)).all()


def test_clusters_hold_their_triangles(mesh, parts):
    assert mesh.cluster_start.tolist() == [0, 12, 12 + len(parts[1])]
    for i, (x, y, z, radius) in enumerate(mesh.cluster_sphere):
        corners = mesh.points_m[mesh.cluster_start[i] : mesh.cluster_start[i + 1]].reshape(-1, 3)
        assert np.linalg.norm(corners - (x, y, z), axis=1).max() <= radius


def test_the_back_of_leaves_is_kept(mesh):
    assert mesh.two_sided.tolist() == [False] * 12 + [True] * (len(mesh.two_sided) - 12)
