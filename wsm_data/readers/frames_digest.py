"""One digest for all images of an episode, and the second pass over a source held against it."""

import hashlib
from collections.abc import Sequence

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_128
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames

ABSENT = ""
"""What stands for the name and the digest of a depth image that a frame does not have."""


def digest_frames(rgb: Sequence[str], depth: Sequence[str]) -> str:
    """Digest of an episode's images: sha256 over the xxh3_128 of each colour and depth image, in time order."""
    digest = hashlib.sha256()
    for colour, distance in zip(rgb, depth, strict=True):
        digest.update(f"{colour}{distance}".encode())
    return digest.hexdigest()


def verified_frames(record: EpisodeRecord, rgb: Sequence[bytes], depth: Sequence[bytes | None]) -> EpisodeFrames:
    """The images of an episode as files, after they were found to be those of the first pass.

    Raises:
        IntegrityError: they have other bytes.
    """
    depths = [ABSENT if image is None else xxh3_128(image) for image in depth]
    if digest_frames([xxh3_128(image) for image in rgb], depths) != record.frames_digest:
        raise source_changed(record.container, f"the images of {record.id.text} have other bytes")
    return EpisodeFrames(rgb=rgb, depth=depth)


def source_changed(container: str, what: str) -> IntegrityError:
    """The error about a source that is not what `wsm index` read."""
    return IntegrityError(f"{container} changed since `wsm index` read it: {what}; run `wsm index` again")
