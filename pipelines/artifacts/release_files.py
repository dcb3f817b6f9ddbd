"""Files about a release: digests of those that a stage reads, and copies of those that it makes, beside the release."""

import logging
from pathlib import Path
from tempfile import TemporaryFile

import fsspec
import xxhash

from wsm_data.errors import ConfigError
from wsm_data.files.atomic import is_full_disk, write_bytes
from wsm_data.files.locations import is_url, require_no_secret

_LOG = logging.getLogger(__name__)
_READ_BYTES = 4 << 20


def content_digest(location: str, missing: str) -> str:
    """xxh3_128 of a file, in hexadecimal, by which its versions are told apart.

    Args:
        location: path or URL.
        missing: what to say where there is no such file.

    Raises:
        ConfigError: there is none, or a URL holds credentials.
    """
    require_no_secret(location)
    digest = xxhash.xxh3_128()
    try:
        with fsspec.open(location, "rb") as file:
            while block := file.read(_READ_BYTES):
                digest.update(block)
    except FileNotFoundError as error:
        raise ConfigError(missing) from error
    return str(digest.hexdigest())


def why_not_writable(release: str, name: str) -> str:
    """Why no file of this name can be written into a release; empty where it can. A nameless one is, and is gone."""
    if is_url(release):
        return "it lies behind a URL"
    folder = next(parent for parent in (Path(release) / name).parents if parent.is_dir())
    try:
        with TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        if is_full_disk(error):
            raise
        return str(error)


def copy_into_release(path: Path, release: str, name: str) -> Path | None:
    """Copy a file into a release, and return the copy; None where nothing can be written (`why_not_writable`).

    Args:
        path: the file.
        release: folder or URL of the release.
        name: name of the copy in the release.
    """
    if is_url(release):
        return None
    copy, data = Path(release) / name, path.read_bytes()
    if copy.is_file() and copy.read_bytes() == data:
        return copy
    if why_not_writable(release, name):
        return None
    write_bytes(copy, data)
    return copy


def warn_if_not_writable(release: str, name: str, otherwise: str) -> None:
    """Say before the work that its result will stay where it is written, and how it is found there.

    Args:
        release: folder or URL of the release.
        name: name of the copy in the release.
        otherwise: how others are told of it.

    Raises:
        ConfigError: the URL holds credentials.
    """
    require_no_secret(release)
    if why := why_not_writable(release, name):
        _LOG.warning("%s will not be copied into %s (%s): %s", name, release, why, otherwise)
