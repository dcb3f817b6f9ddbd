"""Named arrays in one file, and the digest of their content."""

import hashlib
import io
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.files.jsonlines import canonical_json

_LEVEL = 1
"""Of zlib: numpy's own, 6, takes six times as long, and boxes of a scene come out no smaller (measured)."""

_DAMAGED = (
    EOFError,
    KeyError,
    RuntimeError,  # a flag that says "encrypted", and NotImplementedError: an unknown compression
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
"""What zipfile and numpy raise on changed or missing bytes, found by changing bytes one after another."""


def save_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays to a compressed .npz, atomically; equal arrays give equal bytes (the zip's time stamp is fixed)."""
    with atomic_file(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)


def load_arrays(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Read what `save_arrays` wrote.

    Raises:
        IntegrityError: the file is not a whole .npz, or holds other names than `names`.
    """
    data = io.BytesIO(path.read_bytes())  # so that an OSError means the disk, not an offset that damage made up
    try:
        with np.lib.npyio.NpzFile(data, allow_pickle=False) as stored:
            found = {name: stored[name] for name in stored.files}
    except _DAMAGED as error:
        raise IntegrityError(f"{path} is no whole .npz file ({error}); delete it and run the stage again") from error
    if sorted(found) != sorted(names):
        raise IntegrityError(f"{path} must hold the arrays {sorted(names)}, found {sorted(found)}; is it another file?")
    return found


def arrays_digest(arrays: Mapping[str, np.ndarray]) -> str:
    """Return the sha256 over names, dtypes, shapes and bytes of arrays, in hexadecimal."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(canonical_json([name, array.dtype.str, list(array.shape)]).encode())
        digest.update(array.data if array.size else b"")
    return digest.hexdigest()
