import numpy as np
import pytest
from scipy.fft import dctn, idctn

from wsm_data.codecs.dct_kernels import FRAMES, SIDE, cosine_basis, forward, inverse

# Sums of 1024 float32 products of numbers up to 1: a few hundred roundings of 6e-8 each on results up to 32.
TOLERANCE = 2e-5

ALL_FREQUENCIES = np.argwhere(np.ones((FRAMES, SIDE, SIDE))).astype(np.int16)


@pytest.mark.parametrize("length", [FRAMES, SIDE])
def test_the_basis_is_orthonormal(length):
    basis = cosine_basis(length).astype(np.float64)
    np.testing.assert_allclose(basis @ basis.T, np.eye(length), atol=1e-6)


def test_coefficients_are_those_of_scipys_orthonormal_transform():
    plane = np.random.default_rng(0).uniform(-1, 1, (FRAMES, 32, 64)).astype(np.float32)
    out = np.empty((len(ALL_FREQUENCIES), 2, 4), np.float32)
    forward(plane, ALL_FREQUENCIES, cosine_basis(FRAMES), cosine_basis(SIDE), out)
    for row in range(2):
        for column in range(4):
            block = plane[:, 16 * row : 16 * row + 16, 16 * column : 16 * column + 16].astype(np.float64)
            wanted = dctn(block, norm="ortho").reshape(-1)
            np.testing.assert_allclose(out[:, row, column], wanted, atol=TOLERANCE)


def test_the_inverse_is_scipys_inverse_of_the_listed_coefficients():
    rng = np.random.default_rng(1)
    listed = ALL_FREQUENCIES[np.sort(rng.choice(len(ALL_FREQUENCIES), 40, replace=False))]
    coefficients = rng.uniform(-1, 1, (40, 1, 2)).astype(np.float32)
    out = np.full((FRAMES, 16, 32), np.nan, np.float32)
    inverse(coefficients, listed, cosine_basis(FRAMES), cosine_basis(SIDE), out)
    for column in range(2):
        block = np.zeros((FRAMES, SIDE, SIDE))
        block[tuple(listed.T)] = coefficients[:, 0, column]
        np.testing.assert_allclose(
            out[:, :, 16 * column : 16 * column + 16], idctn(block, norm="ortho"), atol=TOLERANCE
        )


def test_the_order_of_the_list_does_not_change_a_coefficient():
    rng = np.random.default_rng(2)
    plane = rng.uniform(-1, 1, (FRAMES, 16, 16)).astype(np.float32)
    shuffled = ALL_FREQUENCIES[rng.permutation(len(ALL_FREQUENCIES))]
    bases = cosine_basis(FRAMES), cosine_basis(SIDE)
    sorted_out, shuffled_out = (np.empty((1024, 1, 1), np.float32) for _ in range(2))
    forward(plane, ALL_FREQUENCIES, *bases, sorted_out)
    forward(plane, shuffled, *bases, shuffled_out)
    by_frequency = {tuple(f): value for f, value in zip(shuffled.tolist(), shuffled_out.ravel(), strict=True)}
    assert all(by_frequency[tuple(f)] == v for f, v in zip(ALL_FREQUENCIES.tolist(), sorted_out.ravel(), strict=True))
