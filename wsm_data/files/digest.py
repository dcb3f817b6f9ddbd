"""Digests: sha256 where a release is vouched for, xxh3 where every member of every sample is checked."""

import hashlib
from pathlib import Path

import xxhash

from wsm_data.files.jsonlines import canonical_json


def sha256_bytes(data: bytes) -> str:
    """Return the sha256 of `data` in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def sha256_file(path: Path) -> str:
    """Return the sha256 of a file in hexadecimal, reading it in pieces."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def digest_json(value: object) -> str:
    """Return the sha256 of a JSON value in its canonical spelling (`canonical_json`)."""
    return sha256_bytes(canonical_json(value).encode())


def xxh3_64(data: bytes | memoryview) -> str:
    """Return the 64-bit xxh3 checksum of a stored member, in hexadecimal."""
    return str(xxhash.xxh3_64_hexdigest(data))


def xxh3_128(data: bytes | memoryview) -> str:
    """Return the 128-bit xxh3 digest that identifies the content of a source frame, in hexadecimal."""
    return str(xxhash.xxh3_128_hexdigest(data))


def xxh3_128_file(path: Path) -> str:
    """Return the 128-bit xxh3 digest of a file in hexadecimal, reading it in pieces: as fast as a disk."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, xxhash.xxh3_128).hexdigest()
