"""The one check that every array field passes, and its messages."""

import numpy as np
import pytest

from wsm_data.schema.arrays import frozen_array, require_array, require_finite


@pytest.mark.parametrize("shape", [(2, 3), (None, 3), (2, None), (None, None)])
def test_an_array_that_fits_is_accepted(shape):
    require_array("x", np.zeros((2, 3), np.float32), np.float32, shape)


@pytest.mark.parametrize("shape", [(2,), (2, 3, 1), (3, 3), (None, 2), ()])
def test_another_shape_is_refused_with_what_must_hold_and_what_was_found(shape):
    with pytest.raises(ValueError, match=r"^poses must be float32 \[.*\], found float32 \[2, 3\]$"):
        require_array("poses", np.zeros((2, 3), np.float32), np.float32, shape)


@pytest.mark.parametrize("dtype", [np.float64, np.int32, ">f4"])
def test_another_dtype_is_refused(dtype):
    with pytest.raises(ValueError, match=r"^poses must be float32 \[any, 3\], found .* \[2, 3\]$"):
        require_array("poses", np.zeros((2, 3), dtype), np.float32, (None, 3))


def test_a_list_is_no_array():
    with pytest.raises(ValueError, match=r"^poses must be an array float32 \[3\], found list$"):
        require_array("poses", [1.0, 2.0, 3.0], np.float32, (3,))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_refused_with_its_first_index(bad):
    array = np.zeros((4, 5), np.float16)
    array[2, 3] = array[3, 0] = bad
    with pytest.raises(ValueError, match=rf"^depth must be finite, found {bad} at index \[2, 3\]$"):
        require_finite("depth", array)


def test_finite_numbers_of_any_size_are_accepted():
    require_finite("depth", np.array([np.finfo(np.float32).max, -0.0, np.finfo(np.float32).tiny], np.float32))
    require_finite("depth", np.zeros((0, 3)))


def test_a_frozen_array_shares_its_memory_and_cannot_be_written_to():
    array = np.arange(6.0)
    frozen = frozen_array(array)
    assert np.shares_memory(frozen, array)
    with pytest.raises(ValueError, match="read-only"):
        frozen[0] = 1
    array[0] = 5.0  # the caller's own array stays writable


def test_exactly_the_float16_patterns_that_numpy_calls_finite_are_accepted():
    patterns = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    finite = np.isfinite(patterns)
    require_finite("latent", patterns[finite].reshape(2, -1)[:, ::3])
    for pattern in patterns[~finite][::17]:
        with pytest.raises(ValueError, match=r"at index \[1\]$"):
            require_finite("latent", np.array([0, pattern], np.float16))
