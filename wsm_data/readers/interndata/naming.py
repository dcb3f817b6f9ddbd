"""Which file of a container is what: the table of which episode, which frame of which episode, which cloud."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from wsm_data.errors import DataError, Reason

_TRAILING_NUMBER = re.compile(r"(?<![0-9])[0-9]{1,18}$")
_CHUNK = r"chunk-[0-9]+"
_NUMBER = r"[0-9]{1,18}"  # of 64 bits, and far above any count of files
_IMAGE = rf"(?:episode_(?P<episode>{_NUMBER})_)?(?P<number>{_NUMBER})"


class Kind(StrEnum):
    """What a file of a container is for."""

    TABLE = "table"
    RGB = "rgb"
    DEPTH = "depth"
    CLOUD = "cloud"
    LENGTHS = "lengths"
    STATS = "stats"


_PATTERNS = tuple(
    (kind, re.compile(rf"(?:(?P<folder>[^/]+)/)?{pattern}"))
    for kind, pattern in (
        (Kind.RGB, rf"videos/{_CHUNK}/observation\.images\.rgb/{_IMAGE}\.(?i:jpe?g)"),
        (Kind.DEPTH, rf"videos/{_CHUNK}/observation\.images\.depth/{_IMAGE}\.(?i:png)"),
        (Kind.TABLE, rf"data/{_CHUNK}/episode_(?P<episode>{_NUMBER})\.(?i:parquet)"),
        (Kind.CLOUD, rf"meta/pointcloud\.ply|(?:(?P<folder2>[^/]+)/)?data/{_CHUNK}/path\.ply"),
        (Kind.LENGTHS, r"meta/episodes\.jsonl"),
        (Kind.STATS, r"meta/episodes_stats\.jsonl"),
    )
)


@dataclass(frozen=True, slots=True)
class Role:
    """What a file name says.

    Attributes:
        kind: what the file is for.
        folder: the trajectory folder it lies in, inside an archive of such folders; else empty.
        episode: the episode number in its name, if there is one.
        number: the image number in its name, if it is an image.
    """

    kind: Kind
    folder: str
    episode: int | None
    number: int | None


@dataclass(frozen=True, slots=True)
class ImageSpan:
    """Positions of an episode's images in the scene's list of images sorted by number; both ends belong to it."""

    first: int
    last: int


def role_of(name: str) -> Role | None:
    """Role of a file by its name relative to the container; None for files that are not read, such as the mp4s.

    The lossy 8-bit videos beside the images are never read: no metric work is possible on them.
    """
    for kind, pattern in _PATTERNS:
        match = pattern.fullmatch(name)
        if match:
            groups = match.groupdict()
            episode, number = groups.get("episode"), groups.get("number")
            return Role(
                kind,
                groups["folder"] or groups.get("folder2") or "",
                None if episode is None else int(episode),
                None if number is None else int(number),
            )
    return None


def episode_name(folder: str) -> str:
    """Name of the episode in a trajectory folder: its trailing number as six digits, else the folder's own name.

    So `trajectory_07` and `episode_000007.parquet` of a scene folder are the same episode, "000007".
    """
    match = _TRAILING_NUMBER.search(folder)
    return f"{int(match[0]):06d}" if match else folder


def frame_numbers(
    numbers: Iterable[int], first: int, last: int | None, where: str, advice: str = "fetch the scene again"
) -> list[int]:
    """The image numbers of one episode in time order, checked to have no gap.

    Args:
        numbers: numbers that are there, of this episode and maybe of others.
        first: number of the episode's first image.
        last: number of its last image; None where only the images themselves say so.
        where: what to call them in messages.
        advice: what to do where there is no image.

    Raises:
        DataError: `frame.missing` when there is no image, or one is absent before the last that is there. Images absent
            at the end show in the counts, which the caller compares.
    """
    present = sorted(number for number in numbers if number >= first and (last is None or number <= last))
    if not present:
        message = f"{where}: an episode needs images, found none; {advice}"
        raise DataError(Reason.FRAME_MISSING, message, {"frames": 0})
    absent = present[-1] + 1 - first - len(present)  # counted, not listed: a name may hold a time stamp
    if absent:
        first_absent = next(number for number, found in enumerate(present, first) if number != found)
        raise DataError(
            Reason.FRAME_MISSING,
            f"{where}: images must be numbered {first} to {present[-1]} without a gap, but {absent} are missing, "
            f"the first is {first_absent}; fetch the scene again, or remove what is no image of it",
            {"missing": absent, "first_missing": first_absent},
        )
    return present


def scene_offset(numbers: Iterable[int], spans: Mapping[int, ImageSpan], where: str) -> int:
    """What to add to a position in a scene's sorted image list to get the number in an image's name.

    A complete list may start at any number. In an incomplete one positions would be shifted by what is missing, so
    that numbers are taken for positions only where the first image is number 0.

    Raises:
        DataError: `frame.missing` when images are missing and it cannot be told which.
    """
    present = set(numbers)
    if not present:
        return 0
    first, expected = min(present), max(span.last for span in spans.values()) + 1
    if first == 0 or len(present) == expected:
        return first
    raise DataError(
        Reason.FRAME_MISSING,
        f"{where}: meta/episodes_stats.jsonl counts {expected} images in the scene, found {len(present)} that start "
        f"with number {first}: which are missing cannot be told; fetch the scene again",
        {"expected": expected, "found": len(present), "first_number": first},
    )
