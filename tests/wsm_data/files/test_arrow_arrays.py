"""Columns and arrays say the same; what pyarrow makes of them is the reference."""

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from wsm_data.files.arrow_arrays import arrow_numbers, arrow_texts, numpy_of

KINDS = (np.int8, np.uint8, np.int16, np.int32, np.int64, np.float32, np.float64)


@given(st.data())
def test_numbers_go_there_and_back(data):
    dtype = data.draw(st.sampled_from(KINDS))
    values = data.draw(arrays.arrays(dtype, st.integers(0, 20)))
    column = arrow_numbers(values)
    assert column.type == pa.array(values).type
    np.testing.assert_array_equal(numpy_of(column), values, strict=True)


@given(st.lists(st.text(st.characters(codec="utf-8"))), st.integers(0, 5))
def test_texts_go_there_and_back_in_pieces_too(texts, start):
    column = arrow_texts(texts)
    assert column.equals(pa.array(texts, pa.string()))
    pieces = pa.chunked_array([column.slice(start), column.slice(0, start)])
    assert numpy_of(pieces).tolist() == pieces.to_pylist()


def test_a_slice_and_strided_memory_are_read_right():
    values = np.arange(20)[::2]
    assert numpy_of(arrow_numbers(values).slice(3, 4)).tolist() == [6, 8, 10, 12]
    assert numpy_of(pa.array(["b", "a", "b"]).dictionary_encode().slice(1)).tolist() == ["a", "b"]
    assert numpy_of(pa.array([True, False, True])).tolist() == [True, False, True]


def test_an_empty_column_keeps_its_dtype():
    assert numpy_of(pa.chunked_array([], pa.int32())).dtype == np.int32
    assert numpy_of(pa.chunked_array([], pa.string())).dtype == object


def test_a_missing_value_is_refused():
    with pytest.raises(ValueError, match="1 of 2 values are missing"):
        numpy_of(pa.array([1, None]))
