import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.codecs.png_chunks import has_right_checksums

PNG = cv2.imencode(".png", np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8))[1].tobytes()


def test_a_file_of_another_writer_has_right_checksums():
    assert has_right_checksums(PNG)


@given(st.integers(0, len(PNG) * 8 - 1))
def test_one_flipped_bit_behind_the_signature_is_seen(bit):
    damaged = bytearray(PNG)
    damaged[bit // 8] ^= 1 << bit % 8
    assert has_right_checksums(bytes(damaged)) == (bit < 8 * 8)  # the signature's own 8 bytes are told by their value


@pytest.mark.parametrize("data", [PNG[:-1], PNG[:-12], PNG + b"x", PNG[:8]])
def test_a_file_that_was_cut_or_goes_on_is_seen(data):
    assert not has_right_checksums(data)
