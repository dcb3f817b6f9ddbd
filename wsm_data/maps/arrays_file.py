"""Named arrays in one file, and the digest of their content."""

import hashlib
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.files.jsonlines import canonical_json


def save_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays to a compressed .npz, atomically; equal arrays give equal bytes (the zip's time stamp is fixed)."""
    with atomic_file(path) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def load_arrays(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Read what `save_arrays` wrote.

    Raises:
        IntegrityError: the file is not a whole .npz, or holds other names than `names`.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            found = {name: stored[name] for name in stored.files}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError) as error:
        if isinstance(error, FileNotFoundError):
            raise
        raise IntegrityError(
            f"{path} is not a readable .npz file ({error}); delete it and run the stage again"
        ) from error
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
