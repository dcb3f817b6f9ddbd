import io
import struct
import zlib
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from wsm_data.codecs.png16 import decode_png16

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def predicted(kind, left, above, corner):
    """What the five filters of the specification, section 9.2, predict of a byte."""
    if kind == 4:
        guess = left + above - corner
        return min((left, above, corner), key=lambda one: abs(guess - one))
    return (0, left, above, (left + above) // 2)[kind]


def filtered(row, before, kind):
    line = row.astype(">u2").tobytes()
    above = before.astype(">u2").tobytes()
    lefts, corners = bytes(2) + line[:-2], bytes(2) + above[:-2]
    pairs = zip(line, lefts, above, corners, strict=True)
    return bytes([kind]) + bytes((byte - predicted(kind, a, b, c)) % 256 for byte, a, b, c in pairs)


def written(image, kinds, *, pieces=1, header=(16, 0, 0, 0, 0), extra=b"", end=b""):
    rows = np.concatenate([np.zeros((1, image.shape[1]), image.dtype), image])
    lines = [filtered(rows[y + 1], rows[y], kinds[y % len(kinds)]) for y in range(len(image))]
    packed = zlib.compress(b"".join(lines) + end)
    cuts = [len(packed) * i // pieces for i in range(pieces + 1)]
    idat = b"".join(chunk(b"IDAT", packed[a:b]) for a, b in pairwise(cuts))
    ihdr = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], *header)
    return SIGNATURE + chunk(b"IHDR", ihdr) + extra + idat + chunk(b"IEND", b"")


IMAGE = np.random.default_rng(0).integers(0, 65536, (7, 11)).astype(np.uint16)


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    kinds=st.lists(st.integers(0, 4), min_size=1, max_size=9),
    pieces=st.integers(1, 3),
)
def test_every_filter_is_undone_to_the_bit(shape, kinds, pieces):
    image = np.random.default_rng(sum(shape)).integers(0, 65536, shape).astype(np.uint16)
    data = written(image, kinds, pieces=pieces)
    decoded = decode_png16(data)
    assert decoded.dtype == np.uint16
    assert np.array_equal(decoded, image)
    assert np.array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), image)


@pytest.mark.parametrize("smooth", [True, False])
def test_files_of_the_usual_writers_are_plain(smooth):
    ramp = np.add.outer(np.arange(54), 3 * np.arange(96)).astype(np.uint16) * 100
    image = ramp if smooth else np.random.default_rng(1).integers(0, 65536, ramp.shape).astype(np.uint16)
    pillow = io.BytesIO()
    Image.fromarray(image).save(pillow, "PNG")
    for data in (pillow.getvalue(), cv2.imencode(".png", image)[1].tobytes()):
        assert np.array_equal(decode_png16(data), image)


@pytest.mark.parametrize("at", range(len(written(IMAGE, [2]))))
def test_a_changed_byte_anywhere_is_noticed(at):
    data = bytearray(written(IMAGE, [2]))
    data[at] ^= 0x10
    assert decode_png16(bytes(data)) is None


def test_a_cut_anywhere_is_noticed_and_so_are_bytes_behind_the_end():
    data = written(IMAGE, [1])
    assert all(decode_png16(data[:size]) is None for size in range(len(data)))
    assert decode_png16(data + b"\0") is None


@pytest.mark.parametrize(
    "header",
    [(8, 0, 0, 0, 0), (16, 2, 0, 0, 0), (16, 0, 1, 0, 0), (16, 0, 0, 1, 0), (16, 0, 0, 0, 1)],
    ids=["8 bits", "colour", "another compression", "another filter method", "interlaced"],
)
def test_other_kinds_of_png_are_left_to_others(header):
    assert decode_png16(written(IMAGE, [0], header=header)) is None


def test_a_text_changes_nothing_and_a_transparent_code_is_left_to_others():
    assert np.array_equal(decode_png16(written(IMAGE, [0], extra=chunk(b"tEXt", b"Comment\0x"))), IMAGE)
    assert decode_png16(written(IMAGE, [0], extra=chunk(b"tRNS", b"\0\0"))) is None


def test_a_filter_that_there_is_not_and_pixels_too_few_or_too_many_are_left_to_others():
    lines = bytes([5, *bytes(22)])
    assert decode_png16(written(IMAGE, [0], end=lines)) is None
    ihdr = chunk(b"IHDR", struct.pack(">IIBBBBB", 11, 1, 16, 0, 0, 0, 0))
    end = chunk(b"IEND", b"")
    assert decode_png16(SIGNATURE + ihdr + chunk(b"IDAT", zlib.compress(lines)) + end) is None
    assert decode_png16(SIGNATURE + ihdr + chunk(b"IDAT", zlib.compress(lines[:-1])) + end) is None


def test_a_wrong_checksum_of_the_pixels_is_noticed_though_the_chunk_is_whole():
    packed = bytearray(zlib.compress(bytes(23)))
    packed[-1] ^= 1
    ihdr = chunk(b"IHDR", struct.pack(">IIBBBBB", 11, 1, 16, 0, 0, 0, 0))
    assert decode_png16(SIGNATURE + ihdr + chunk(b"IDAT", bytes(packed)) + chunk(b"IEND", b"")) is None


def test_a_header_that_promises_a_giant_allocates_nothing():
    data = SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", 1 << 30, 1 << 30, 16, 0, 0, 0, 0))
    assert decode_png16(data + chunk(b"IDAT", zlib.compress(bytes(23))) + chunk(b"IEND", b"")) is None
