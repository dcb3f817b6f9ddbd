import numpy as np
import pytest

from wsm_data.synth.render.noise import clouds, coordinates, mix, normalised, smooth_step


def test_clouds_go_on_across_their_edges():
    field = clouds(np.random.default_rng(0), 64, 1.5)
    inside = np.abs(np.diff(field, axis=1)).mean()
    seam = np.abs(field[:, 0] - field[:, -1]).mean()
    assert seam < 2 * inside


def test_rougher_clouds_are_larger():
    def step(roughness: float) -> float:
        return float(np.abs(np.diff(clouds(np.random.default_rng(0), 64, roughness))).mean())

    assert step(2.0) < 0.5 * step(1.0) < 0.5 * step(0.0)


def test_stretched_clouds_are_longer_along_that_axis():
    field = clouds(np.random.default_rng(0), 64, 1.0, (8.0, 1.0))
    assert np.abs(np.diff(field, axis=1)).mean() < 0.5 * np.abs(np.diff(field, axis=0)).mean()


def test_normalising_fills_the_unit_interval():
    field = normalised(np.arange(1000.0))
    assert (field.min(), field.max()) == (0, 1)
    assert field[500] == pytest.approx(0.5, abs=0.001)


def test_coordinates_are_those_of_texel_centres():
    u, v = coordinates(4)
    assert u[2].tolist() == [0.125, 0.375, 0.625, 0.875]
    assert v[:, 1].tolist() == [0.125, 0.375, 0.625, 0.875]


def test_mixing_and_stepping_go_from_one_end_to_the_other():
    assert mix((0, 0, 0), (1, 0.5, 0), np.array([0.0, 0.5, 1.0])).tolist() == [[0, 0, 0], [0.5, 0.25, 0], [1, 0.5, 0]]
    assert smooth_step(np.array([0.0, 1.0, 1.5, 2.0, 9.0]), 1.0, 2.0).tolist() == [0, 0, 0.5, 1, 1]
