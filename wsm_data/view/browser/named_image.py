"""The image file that a refusal names as damaged, as far as it can be decoded."""

import re
from pathlib import Path

import cv2
import numpy as np
import simplejpeg

from wsm_data.errors import ConfigError
from wsm_data.readers.archive.tar_walk import walk_tar
from wsm_data.schema.arrays import Uint8Array

_MAX_BYTES = 64 << 20
_JPEG_START = b"\xff\xd8"
_SIXTEEN_BITS = 257.0  # from 65535 to 255


def named_image(message: str) -> tuple[str, str] | None:
    """Container and member that a message begins with, as `home_0001:videos/000100.jpg`; None: it names no image."""
    found = re.match(r"([^:\n]+):([^:\n]+\.(?:jpe?g|png))\b", message, re.IGNORECASE)
    return (found[1], found[2]) if found else None


def decode_damaged(root: Path, container: str, member: str) -> Uint8Array:
    """What can still be decoded of an image of a source, uint8 [H, W, 3]; what a file lost stays grey.

    Args:
        root: root of the source.
        container: folder or archive below it.
        member: name of the file in it.

    Raises:
        ConfigError: the file is not there, leads out of the source, or nothing of it can be decoded.
        DataError: an archive cannot be read up to the file.
    """
    place = (root / container).resolve()
    if not place.is_relative_to(root.resolve()):
        raise ConfigError(f"{container} must lie in the source {root}")
    data = _from_folder(place, member) if place.is_dir() else _from_archive(place, member)
    if data.startswith(_JPEG_START):
        try:
            return simplejpeg.decode_jpeg(data, "RGB", strict=False)
        except ValueError as error:
            raise ConfigError(f"nothing of {container}:{member} can be shown: {error}") from error
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if picture is None:
        raise ConfigError(f"nothing of {container}:{member} can be shown: {len(data)} bytes that are no image")
    if picture.dtype == np.uint16:
        picture = (picture / _SIXTEEN_BITS).astype(np.uint8)
    if picture.ndim == 2:
        return np.repeat(picture[:, :, None], 3, axis=2)
    return np.ascontiguousarray(picture[:, :, 2::-1])


def _from_folder(folder: Path, member: str) -> bytes:
    path = (folder / member).resolve()
    if not path.is_relative_to(folder) or not path.is_file() or path.stat().st_size > _MAX_BYTES:
        raise ConfigError(f"there is no image {member} in {folder}")
    return path.read_bytes()


def _from_archive(archive: Path, member: str) -> bytes:
    if not archive.is_file():
        raise ConfigError(f"there is no file {archive}")
    for found in walk_tar(archive, str(archive), member.__eq__, _MAX_BYTES):
        if found.name == member:
            return bytes(found.content())
    raise ConfigError(f"there is no image {member} in {archive}")
