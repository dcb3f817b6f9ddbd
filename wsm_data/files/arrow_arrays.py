"""Arrow columns to numpy and back without pandas.

pyarrow's own conversions (`to_numpy`, `pa.array`, `pc.index`) import pandas wherever it is installed, although they do
not need it: 150 ms at the first batch. These look at the buffers.
"""

from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc


def numpy_of(column: pa.Array | pa.ChunkedArray) -> np.ndarray:
    """A column without nulls as an array: numbers as they are stored, other values as Python objects.

    Numbers of one piece are a view, which must not be written to.

    Raises:
        ValueError: a value is missing.
    """
    if column.null_count:
        raise ValueError(f"{column.null_count} of {len(column)} values are missing, where none may be")
    chunks = column.chunks if isinstance(column, pa.ChunkedArray) else [column]
    parts = [_numpy_of_one(chunk) for chunk in chunks if len(chunk)]
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if parts else np.empty(0, _dtype(column.type))


def arrow_numbers(values: np.ndarray) -> pa.Array:
    """An array of whole or floating-point numbers as a column; NaN stays NaN."""
    flat = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(flat.dtype), len(flat), [None, pa.py_buffer(flat)])


def arrow_texts(texts: Sequence[str]) -> pa.StringArray:
    """Texts as a column.

    Raises:
        OverflowError: they take more than 2 GiB together.
    """
    encoded = [text.encode() for text in texts]
    ends = np.cumsum([0, *(len(one) for one in encoded)], dtype=np.int64)
    if ends[-1] > np.iinfo(np.int32).max:
        raise OverflowError(f"texts of a column must not exceed 2 GiB, found {ends[-1]} bytes")
    buffers = [None, pa.py_buffer(ends.astype(np.int32)), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(texts), buffers)


def _numpy_of_one(chunk: pa.Array) -> np.ndarray:
    if pa.types.is_boolean(chunk.type):
        return _numpy_of_one(pc.cast(chunk, pa.uint8())).astype(bool)
    if pa.types.is_dictionary(chunk.type):
        return _numpy_of_one(chunk.dictionary)[_numpy_of_one(chunk.indices)]
    if not pa.types.is_primitive(chunk.type):
        values = np.empty(len(chunk), object)
        values[:] = chunk.to_pylist()
        return values
    return np.frombuffer(chunk.buffers()[1], _dtype(chunk.type))[chunk.offset : chunk.offset + len(chunk)]


def _dtype(kind: pa.DataType) -> np.dtype:
    return np.dtype(kind.to_pandas_dtype() if pa.types.is_primitive(kind) else object)
