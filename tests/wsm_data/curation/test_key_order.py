import numpy as np
import pyarrow as pa
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.key_order import key_hashes

WORD = 2**64


def slow_hash(text):
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = (value ^ byte) * 0x100000001B3 % WORD
    value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9 % WORD
    value = (value ^ (value >> 27)) * 0x94D049BB133111EB % WORD
    return value ^ (value >> 31)


@given(st.lists(st.text(max_size=12), max_size=10))
def test_the_hash_is_fnv_1a_with_the_finaliser_of_splitmix64(texts):
    assert key_hashes(pa.array(texts, pa.string())).tolist() == [slow_hash(text) for text in texts]


def test_fnv_1a_is_that_of_its_authors():
    """0x85944171f73967e8 is the published FNV-1a of `foobar`; the finaliser is undone by none, so it is applied."""
    value = 0xCBF29CE484222325
    for byte in b"foobar":
        value = (value ^ byte) * 0x100000001B3 % WORD
    assert value == 0x85944171F73967E8


def test_a_slice_of_keys_has_the_hashes_of_the_slice():
    keys = pa.array([f"g/s/{number:06d}" for number in range(20)])
    assert key_hashes(keys.slice(5, 7)).tolist() == key_hashes(keys)[5:12].tolist()


def test_keys_that_differ_in_their_last_digit_are_spread():
    places = key_hashes(pa.array([f"g/s/{number:06d}" for number in range(4096)])) >> np.uint64(60)
    assert np.bincount(places.astype(int), minlength=16).min() > 256 / 2  # 256 expected in each sixteenth
