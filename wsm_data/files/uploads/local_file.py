"""A file that is to be uploaded: its size, and the digests by which a store can say that it has it."""

import base64
import hashlib
from dataclasses import dataclass
from pathlib import Path

_READ_BYTES = 4 << 20


@dataclass(frozen=True, kw_only=True)
class LocalFile:
    """A file on this machine, as it was read once.

    Attributes:
        path: where it lies.
        size_bytes: its size.
        sha256: of all of it, in hexadecimal.
        git_sha1: by which git names these bytes, in hexadecimal.
        part_bytes: size of the parts that it is uploaded in; the last one is shorter.
        part_md5s: digest of each part; of a file of no bytes, that of nothing.
    """

    path: Path
    size_bytes: int
    sha256: str
    git_sha1: str
    part_bytes: int
    part_md5s: tuple[bytes, ...]

    @property
    def etag(self) -> str:
        """What S3 calls an object of these bytes that came in these parts.

        One part: its MD5. Several: the MD5 of their MD5s, and their number. Stores that encrypt with keys of a customer
        call it something else.
        """
        if len(self.part_md5s) == 1:
            return self.part_md5s[0].hex()
        joined = hashlib.md5(b"".join(self.part_md5s), usedforsecurity=False)
        return f"{joined.hexdigest()}-{len(self.part_md5s)}"

    def content_md5(self, number: int) -> str:
        """Digest of a part, counted from 0, as the header Content-MD5 spells it (RFC 1864)."""
        return base64.b64encode(self.part_md5s[number]).decode()

    def part(self, number: int) -> bytes:
        """The bytes of a part, counted from 0."""
        with self.path.open("rb") as file:
            file.seek(number * self.part_bytes)
            return file.read(self.part_bytes)


def look_at(path: Path, part_bytes: int) -> LocalFile:
    """Read a file once, for all its digests."""
    size_bytes = path.stat().st_size
    whole, git = hashlib.sha256(), hashlib.sha1(b"blob %d\0" % size_bytes, usedforsecurity=False)
    part_md5s = []
    with path.open("rb") as file:
        for _ in range(max(1, -(-size_bytes // part_bytes))):
            part = hashlib.md5(usedforsecurity=False)
            left = part_bytes
            while left and (block := file.read(min(_READ_BYTES, left))):
                left -= len(block)
                for digest in (whole, git, part):
                    digest.update(block)
            part_md5s.append(part.digest())
    return LocalFile(
        path=path,
        size_bytes=size_bytes,
        sha256=whole.hexdigest(),
        git_sha1=git.hexdigest(),
        part_bytes=part_bytes,
        part_md5s=tuple(part_md5s),
    )
