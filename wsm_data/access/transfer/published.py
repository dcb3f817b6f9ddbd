"""published.json: what a store itself said of each file when it had been uploaded and compared.

By it a published release is looked at again without reading it: a store that names its bytes by a checksum names
changed ones otherwise.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass

from wsm_data.errors import IntegrityError
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.sealed import sealed, unsealed
from wsm_data.files.stores import Store

PUBLISHED_NAME = "published.json"


@dataclass(frozen=True, kw_only=True)
class PublishedFile:
    """One file behind a URL.

    Attributes:
        size_bytes: its size.
        checksum: what the store said of its bytes, as `etag:...`; empty where it says nothing.
    """

    size_bytes: int
    checksum: str


@dataclass(frozen=True, kw_only=True)
class Published:
    """The files of a release behind a URL, dataset.json left out.

    Attributes:
        release: digest of the release.
        files: what the store said of each, by name.
    """

    release: str
    files: Mapping[str, PublishedFile]


def published_bytes(published: Published) -> bytes:
    """The one spelling of published.json."""
    return json.dumps(sealed(to_json(published)), sort_keys=True, indent=2).encode() + b"\n"


def read_published(store: Store) -> Published | None:
    """Read published.json; None where there is none.

    Raises:
        IntegrityError: it was changed since it was written.
    """
    if not store.exists(PUBLISHED_NAME):
        return None
    try:
        return from_json(Published, unsealed(json.loads(store.read(PUBLISHED_NAME))))
    except ValueError as error:
        raise IntegrityError(
            f"{store.root}/{PUBLISHED_NAME} must say what was published, but: {error}; publish the release again"
        ) from error
