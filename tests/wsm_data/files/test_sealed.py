"""A sealed object is read back as it was, or not at all."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.files.sealed import sealed, unsealed

VALUES = st.recursive(
    st.none() | st.integers() | st.text() | st.floats(allow_nan=False, allow_infinity=False), st.lists, max_leaves=10
)


@settings(max_examples=40)
@given(st.dictionaries(st.text().filter(lambda name: name != "xxh3"), VALUES))
def test_through_json_it_comes_back_equal(record):
    assert unsealed(json.loads(json.dumps(sealed(record)))) == record


@given(st.integers(0, 10**6), st.integers(0, 7))
def test_a_flipped_bit_is_no_json_any_more_or_found(place, bit):
    text = bytearray(json.dumps(sealed({"step": 2, "name": "a", "list": [1, 2.5]})).encode())
    text[place % len(text)] ^= 1 << bit
    with pytest.raises(ValueError, match=r"."):
        unsealed(json.loads(bytes(text)))


@pytest.mark.parametrize("other", [[], 1, None, {"step": 2}])
def test_what_was_never_sealed_is_refused(other):
    with pytest.raises(ValueError, match="must be an object with the checksum"):
        unsealed(other)
