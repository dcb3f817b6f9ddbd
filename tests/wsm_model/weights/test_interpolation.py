"""Pretrained tensors at another width."""

import numpy as np
import pytest
import torch

from wsm_model.weights.interpolation import resize_dimension, resize_tensor


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


def test_a_matrix_with_fewer_inputs_is_scaled_to_keep_the_variance():
    """sqrt(source / target) where the input shrinks, nothing where it grows."""
    ones = torch.ones(2, 8)
    assert torch.allclose(resize_tensor(ones, (2, 2), 1), torch.full((2, 2), 2.0))
    assert torch.equal(resize_tensor(ones, (2, 16), 1), torch.ones(2, 16))
    assert torch.equal(resize_tensor(ones, (1, 8), 1), torch.ones(1, 8))


def test_another_number_of_dimensions_is_a_bug():
    with pytest.raises(ValueError, match="cannot be resized"):
        resize_tensor(torch.ones(2, 2), (2,), None)
