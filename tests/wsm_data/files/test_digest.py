"""Digests against published test vectors, and what they do and do not tell apart."""

import pytest

from wsm_data.files.digest import digest_json, sha256_bytes, sha256_file, xxh3_64, xxh3_128

SHA256_OF_ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"  # FIPS 180-2, appendix B.1
SHA256_OF_NOTHING = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
XXH3_64_OF_NOTHING = "2d06800538d394c2"  # xxHash's reference implementation, seed 0
XXH3_128_OF_NOTHING = "99aa06d3014798d86001c324468d497f"


def test_sha256_gives_the_published_digests():
    assert sha256_bytes(b"abc") == SHA256_OF_ABC
    assert sha256_bytes(b"") == SHA256_OF_NOTHING


def test_xxh3_gives_the_reference_digests():
    assert xxh3_64(b"") == XXH3_64_OF_NOTHING
    assert xxh3_128(b"") == XXH3_128_OF_NOTHING


@pytest.mark.parametrize("size_bytes", [0, 1, 4095, (1 << 20) + 7])
def test_a_file_has_the_digest_of_its_bytes(tmp_path, size_bytes):
    data = (b"\x00\x01\x02\x03\x04\x05\x06" * (size_bytes // 7 + 1))[:size_bytes]
    (tmp_path / "a.bin").write_bytes(data)
    assert sha256_file(tmp_path / "a.bin") == sha256_bytes(data)


def test_one_flipped_bit_changes_every_digest():
    data = bytearray(range(256)) * 16
    flipped = bytearray(data)
    flipped[2000] ^= 1
    for digest in (sha256_bytes, xxh3_64, xxh3_128):
        assert digest(bytes(data)) != digest(bytes(flipped))


def test_checksums_read_a_memory_view_without_a_copy_of_it():
    data = bytes(range(200))
    assert xxh3_64(memoryview(data)[50:150]) == xxh3_64(data[50:150])
    assert xxh3_128(memoryview(data)[50:150]) == xxh3_128(data[50:150])


def test_the_order_of_keys_does_not_change_a_json_digest():
    assert digest_json({"b": [1, 2.5], "a": None}) == digest_json({"a": None, "b": [1, 2.5]})


def test_a_tuple_and_a_list_are_the_same_json():
    assert digest_json({"size": (320, 192)}) == digest_json({"size": [320, 192]})


@pytest.mark.parametrize(("one", "other"), [([1, 2], [2, 1]), ({"a": 1}, {"a": "1"}), (0.1, 0.1 + 1e-16), ({}, [])])
def test_different_json_has_different_digests(one, other):
    assert digest_json(one) != digest_json(other)


def test_a_json_digest_is_the_sha256_of_the_canonical_spelling():
    assert digest_json({"b": 1, "a": "µ"}) == sha256_bytes(b'{"a":"\\u00b5","b":1}')
