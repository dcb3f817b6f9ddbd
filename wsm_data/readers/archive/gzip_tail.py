"""Whether a gzip file may end where its tar does, told from its last bytes alone."""

import io
import os
from pathlib import Path

from wsm_data.readers.archive.tar_header import BLOCK_BYTES
from wsm_data.readers.unreadable import open_file

_LENGTH_BYTES = 4


def ends_like_a_tar(path: Path, where: str) -> bool:
    """Whether the last four bytes are a length that a tar can have: a multiple of its blocks.

    RFC 1952 ends a gzip stream with the length of its content, modulo 2^32. A cut leaves four bytes of compressed data
    there instead, of which one in 512 looks right. A stream of several members ends with the length of the last one,
    which may be any: "no" is a reason to read the file, not to refuse it.

    Raises:
        DataError: `file.unreadable`, `file.not_regular`.
    """
    with open_file(path, where) as file:
        if os.fstat(file.fileno()).st_size < _LENGTH_BYTES:
            return False
        file.seek(-_LENGTH_BYTES, io.SEEK_END)
        return int.from_bytes(file.read(_LENGTH_BYTES), "little") % BLOCK_BYTES == 0
