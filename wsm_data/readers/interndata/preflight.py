"""Did a scene or trajectory come over whole? All of it is read, nothing decoded; counts are held against meta files."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.gzip_tail import ends_like_a_tar
from wsm_data.readers.archive.member import Member
from wsm_data.readers.archive.tar_stream import open_tar
from wsm_data.readers.images import check_jpeg, check_png16
from wsm_data.readers.interndata.episode_meta import read_lengths
from wsm_data.readers.interndata.naming import Kind, role_of
from wsm_data.readers.interndata.scene_files import iter_members
from wsm_data.readers.source import Container, Preflight
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.source.layout import Layout
from wsm_data.schema.verdict import Refusal

_CHECKS = {Kind.RGB: check_jpeg, Kind.DEPTH: check_png16}
_SHOWN = 3


@dataclass
class _Tally:
    """What has been seen of a container so far."""

    bytes_read: int = 0
    counts: dict[Kind, int] = field(default_factory=lambda: dict.fromkeys(Kind, 0))
    listed_frames: list[int] = field(default_factory=list)
    damaged: list[DataError] = field(default_factory=list)


def preflight_container(source: Path, container: Container, dataset: DatasetManifest, walk: bool) -> Preflight:
    """Read a container from its first byte to its last, or, of an archive that is not walked, only these.

    A folder that is not walked is not looked at. An archive whose last bytes do not look like those of a tar is walked
    in any case.
    """
    is_archive = container.layout == Layout.SCENE_ARCHIVE
    try:
        if is_archive and not walk:
            with open_tar(source / container.id, container.id):
                walk = container.id.endswith("gz") and not ends_like_a_tar(source / container.id, container.id)
        if not walk:
            return Preflight(unit=container.id, walked=False)
        tally = _walked(source, container, dataset)
    except DataError as error:
        refusal = Refusal.from_error(container.id, container.id, error)
        return Preflight(unit=container.id, walked=walk, refusals=(refusal,))
    errors = [*_images(container.id, tally), *_counts(container, tally)]
    return Preflight(
        unit=container.id,
        walked=True,
        bytes_read=tally.bytes_read,
        trajectories=tally.counts[Kind.TABLE],
        refusals=tuple(Refusal.from_error(container.id, container.id, error) for error in errors),
    )


def _walked(source: Path, container: Container, dataset: DatasetManifest) -> _Tally:
    tally = _Tally()
    for member in iter_members(source, container, _is_read, dataset.limits.max_file_bytes):
        role = role_of(member.name)
        if role is not None:
            tally.counts[role.kind] += 1
            tally.bytes_read += member.size
            _look_at(member, role.kind, f"{container.id}:{member.name}", tally)
    return tally


def _is_read(name: str) -> bool:
    return role_of(name) is not None


def _look_at(member: Member, kind: Kind, where: str, tally: _Tally) -> None:
    try:
        data = member.content()
        if kind in _CHECKS:
            _CHECKS[kind](data, where)
        elif kind is Kind.LENGTHS:
            tally.listed_frames += read_lengths(data).values()
    except DataError as error:
        tally.damaged.append(error)


def _images(where: str, tally: _Tally) -> list[DataError]:
    """One error a reason: a scene has thousands of images, and a cut download spoils many of them alike."""
    by_reason: dict[Reason, list[DataError]] = {}
    for error in tally.damaged:
        by_reason.setdefault(error.reason, []).append(error)
    return [
        DataError(
            reason,
            f"{where}: all files must be whole, and {len(errors)} are not: "
            + "; ".join(error.message for error in errors[:_SHOWN]),
            {"files": len(errors)},
        )
        for reason, errors in by_reason.items()
    ]


def _counts(container: Container, tally: _Tally) -> list[DataError]:
    """What is there against what should be: as many images of depth as of colour, and what meta/episodes.jsonl lists.

    What a trajectory folder has of that file may be its scene's, and list the scene's other episodes.
    """
    where = container.id
    tables, colour, depth = (tally.counts[kind] for kind in (Kind.TABLE, Kind.RGB, Kind.DEPTH))
    errors = []
    if tables == 0 or colour != depth:
        errors.append(
            DataError(
                Reason.FRAME_COUNT_MISMATCH if tables else Reason.CONTAINER_NO_EPISODES,
                f"{where} must hold an episode and as many colour as depth images, found {tables} tables, {colour} and "
                f"{depth} images; fetch it again",
                _numbers(tally.counts),
            )
        )
    listed = len(tally.listed_frames) if container.layout != Layout.TRAJECTORY_FOLDER else 0
    if listed > tables > 0:
        message = f"{where}: meta/episodes.jsonl lists {listed} episodes, found {tables} tables; fetch it again"
        errors.append(DataError(Reason.EPISODE_MISSING, message, {"listed": listed, "tables": tables}))
    elif listed == tables > 0 and sum(tally.listed_frames) > colour:
        frames = sum(tally.listed_frames)
        message = f"{where}: meta/episodes.jsonl lists {frames} frames, found {colour} colour images; fetch it again"
        errors.append(DataError(Reason.FRAME_MISSING, message, {"listed": frames, "images": colour}))
    return errors


def _numbers(counts: Mapping[Kind, int]) -> dict[str, int]:
    return {str(kind): count for kind, count in counts.items()}
