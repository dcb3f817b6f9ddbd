"""Pretrained tensors at another width."""

import numpy as np
import pytest
import torch

from wsm_model.weights.interpolation import kept_variance, resize_dimension, resize_tensor


def test_ends_stay_and_between_them_values_lie_on_the_lines():
    values = torch.tensor([0.0, 10.0, 40.0])
    assert resize_dimension(values, 0, 5).tolist() == [0.0, 5.0, 10.0, 25.0, 40.0]
    assert resize_dimension(values, 0, 2).tolist() == [0.0, 40.0]


@pytest.mark.parametrize("size", [3, 7, 11])
def test_it_is_numpys_linear_interpolation_with_ends_on_ends(size):
    values = torch.randn(4, 9, generator=torch.Generator().manual_seed(0))
    wanted = [np.interp(np.linspace(0, 8, size), np.arange(9), row) for row in values.double().numpy()]
    np.testing.assert_allclose(resize_dimension(values, 1, size).numpy(), wanted, atol=1e-6)  # float32


def test_dimensions_that_agree_are_copied():
    values = torch.randn(3, 4)
    assert torch.equal(resize_tensor(values, (3, 4), 1), values)


@pytest.mark.parametrize(
    ("shape", "growth"), [((150, 300), 1.0), ((300, 150), 2.0), ((150, 150), 2.0), ((70, 600), 1.0)]
)
def test_a_matrix_keeps_the_variance_of_independent_entries_and_of_what_comes_out(shape, growth):
    """300 x 300 standard normal entries: 4 % is four standard errors; half the inputs have twice the variance each."""
    matrix = torch.randn(300, 300, generator=torch.Generator().manual_seed(0))
    assert float(resize_tensor(matrix, shape, 1).var()) == pytest.approx(growth, rel=0.04)


def test_interpolation_leaves_two_thirds_of_the_variance_and_all_of_it_where_nothing_lies_between():
    """The mean of (1 - w)^2 + w^2 over w in [0, 1] is 2 / 3; ends and every second entry are taken as they are."""
    assert kept_variance(3072, 1536) == pytest.approx(2 / 3, abs=1e-3)
    assert kept_variance(9, 5) == kept_variance(4, 2) == 1.0


def test_vectors_are_not_scaled():
    assert torch.equal(resize_tensor(torch.ones(8), (5,), None), torch.ones(5))


def test_another_number_of_dimensions_is_a_bug():
    with pytest.raises(ValueError, match="cannot be resized"):
        resize_tensor(torch.ones(2, 2), (2,), None)
