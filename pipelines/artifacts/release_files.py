"""Files about a release: digests of those that a stage reads, and copies of those that it makes, beside the release."""

import logging
from pathlib import Path

import fsspec
import xxhash

from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_bytes

_LOG = logging.getLogger(__name__)
_READ_BYTES = 4 << 20


def content_digest(location: str, missing: str) -> str:
    """xxh3_128 of a file, in hexadecimal, by which its versions are told apart.

    Args:
        location: path or URL.
        missing: what to say where there is no such file.

    Raises:
        ConfigError: there is none.
    """
    digest = xxhash.xxh3_128()
    try:
        with fsspec.open(location, "rb") as file:
            while block := file.read(_READ_BYTES):
                digest.update(block)
    except FileNotFoundError as error:
        raise ConfigError(missing) from error
    return str(digest.hexdigest())


def copy_into_release(path: Path, release: str, name: str, otherwise: str) -> Path | None:
    """Copy a file into a local release, and return the copy; where that cannot be, warn and return None.

    Args:
        path: the file.
        release: folder or URL of the release; nothing is written behind a URL.
        name: name of the copy in the release.
        otherwise: how the file is found where it is.
    """
    if "://" in release:
        _LOG.warning("%s is not copied to %s: put it there as %s", path, release, name)
        return None
    copy, data = Path(release) / name, path.read_bytes()
    if copy.is_file() and copy.read_bytes() == data:
        return copy
    try:
        write_bytes(copy, data)
    except PermissionError as error:
        _LOG.warning("%s cannot be copied into its release (%s); %s", path, error, otherwise)
        return None
    return copy
