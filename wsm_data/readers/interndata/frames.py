"""The second pass over a container: the image bytes of whole episodes, each checked against the first pass."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from wsm_data.errors import DataError
from wsm_data.readers.frames_digest import source_changed, verified_frames
from wsm_data.readers.interndata.scene_files import iter_members
from wsm_data.readers.source import Container
from wsm_data.readers.unreadable import read_file
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.source.layout import Layout


def iter_episode_frames(
    source: Path, container: Container, dataset: DatasetManifest, records: Sequence[EpisodeRecord]
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    """Yield the images of the wanted episodes of a container, each episode as soon as it is complete.

    A folder gives them in the order of `records` and reads an episode only when it is asked for. An archive is read
    once from its start, gives them in the order in which they become complete, holds the images that wait for others
    compressed, and is left as soon as the last wanted episode is out.

    Raises:
        IntegrityError: the images are not those of the first pass: the source changed since.
        ValueError: a record belongs to another container.
    """
    for record in records:
        if record.container != container.id:
            raise ValueError(f"{record.id.text} is in {record.container}, not in {container.id}")
    if container.layout == Layout.SCENE_ARCHIVE:
        yield from _from_archive(source, container, records, dataset.limits.max_file_bytes)
    else:
        yield from _from_folder(source / container.id, records, dataset.limits.max_file_bytes)


def _from_folder(
    root: Path, records: Sequence[EpisodeRecord], max_bytes: int
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    for record in records:
        try:
            rgb, depth = (
                tuple(read_file(f"{root}/{name}", f"{record.container}:{name}", max_bytes) for name in names)
                for names in (record.rgb_members, record.depth_members)
            )
        except DataError as error:
            raise source_changed(record.container, error.message) from error
        yield record, verified_frames(record, rgb, depth)


def _from_archive(
    source: Path, container: Container, records: Sequence[EpisodeRecord], max_bytes: int
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    owner = {name: record for record in records for name in (*record.rgb_members, *record.depth_members)}
    waiting = {record.id: 2 * record.frame_count for record in records}
    held: dict[str, bytes] = {}
    if not waiting:
        return
    try:
        for member in iter_members(source, container, owner.__contains__, max_bytes):
            record = owner[member.name]
            held[member.name] = bytes(member.content())
            waiting[record.id] -= 1
            if waiting[record.id] == 0:
                del waiting[record.id]
                rgb = tuple(held.pop(name) for name in record.rgb_members)
                depth = tuple(held.pop(name) for name in record.depth_members)
                yield record, verified_frames(record, rgb, depth)
                if not waiting:
                    return
    except DataError as error:
        raise source_changed(container.id, str(error)) from error
    absent = sorted(id_.text for id_ in waiting)
    raise source_changed(container.id, f"images of {', '.join(absent[:3])} are gone ({len(absent)} episodes)")
