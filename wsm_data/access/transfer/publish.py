"""A local release put behind a URL: what is there already is left, and dataset.json comes when all else is compared."""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from wsm_data.access.transfer.config import PublishConfig
from wsm_data.access.transfer.published import PUBLISHED_NAME, Published, PublishedFile, published_bytes
from wsm_data.access.transfer.release_files import ReleaseFiles, release_files
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.retries import NOT_THERE
from wsm_data.files.stores import LocalStore
from wsm_data.files.uploads.local_file import LocalFile, look_at
from wsm_data.files.uploads.target import Target, open_target, send
from wsm_data.shards.names import MANIFEST_NAME, is_shard_name


@dataclass(frozen=True, kw_only=True)
class Moved:
    """What was moved.

    Attributes:
        files: files of the release, dataset.json among them.
        moved_files: how many of them went over the network; the others were there.
        moved_bytes: their sizes.
    """

    files: int
    moved_files: int
    moved_bytes: int


def publish_release(
    folder: Path,
    url: str,
    config: PublishConfig,
    about: Mapping[str, bytes],
    on_progress: Callable[[int], object],
) -> Moved:
    """Put a release behind a URL.

    Each file is compared with what the manifest vouches for before it is uploaded, and with what the store says it
    holds afterwards. Killed at any point, the next call sends what is missing.

    Args:
        folder: the release.
        url: where it goes, as s3://bucket/release or hf://datasets/somebody/release.
        config: how.
        about: files for people that stand beside it there, such as its card, by name.
        on_progress: called with the bytes of each file that is settled.

    Raises:
        ConfigError: another release is there, and `replace` is not set; or nothing can be uploaded to the URL.
        IntegrityError: a file of the release is not what its manifest vouches for, or is missing.
        StoreError: the store refuses, failed in all attempts, or holds other bytes than it was sent.
    """
    files = release_files(LocalStore(str(folder)))
    target = open_target(url)
    _make_room(target, files, config)
    part_bytes = config.part_mib << 20
    sent = []
    for one in _send_all(target, folder, files, config):
        sent.append(one)
        on_progress(one.file.size_bytes)
    target.settle()
    _remove_others(target, files)
    with TemporaryDirectory(prefix="wsm-publish-") as scratch:
        last = {
            **about,
            PUBLISHED_NAME: published_bytes(_published(target, files, sent)),
            MANIFEST_NAME: files.manifest_bytes,
        }
        for name, data in last.items():
            if name == MANIFEST_NAME:
                target.settle()  # all else is seen before
            path = Path(scratch, name)
            path.write_bytes(data)
            sent.append(_send(target, name, look_at(path, part_bytes)))
        target.settle()
    of_release = [one for one in sent if one.name not in {*about, PUBLISHED_NAME}]
    return Moved(
        files=len(of_release),
        moved_files=sum(one.was_sent for one in of_release),
        moved_bytes=sum(one.file.size_bytes for one in of_release if one.was_sent),
    )


@dataclass(frozen=True, kw_only=True)
class _Sent:
    """A file that the store has, and whether it had to be sent."""

    name: str
    file: LocalFile
    was_sent: bool


def _make_room(target: Target, files: ReleaseFiles, config: PublishConfig) -> None:
    """Withdraw the manifest of another release, where that is wanted: nobody may read half of each.

    Raises:
        ConfigError: there is one, and it is not to be replaced.
    """
    try:
        there = target.store.read(MANIFEST_NAME)
    except NOT_THERE:
        return
    if there == files.manifest_bytes:
        return
    if not config.replace:
        raise ConfigError(
            f"{target.store.root} must be empty or hold the release {files.manifest.name} with digest {files.digest}, "
            "and holds another one; publish to another URL, or give --replace"
        )
    target.remove(MANIFEST_NAME)
    target.settle()


def _send_all(target: Target, folder: Path, files: ReleaseFiles, config: PublishConfig) -> Iterator[_Sent]:
    """Send everything but the manifest, several files at a time, as each is settled."""

    def send_one(name: str) -> _Sent:
        return _send(target, name, _checked(folder / name, files.vouched.get(name), config.part_mib << 20))

    with ThreadPoolExecutor(config.threads, thread_name_prefix="wsm-publish") as pool:
        waiting = [pool.submit(send_one, name) for name in (*files.vouched, *files.attached)]
        try:
            yield from (done.result() for done in as_completed(waiting))
        finally:
            pool.shutdown(cancel_futures=True)  # after a failure: what was begun ends, the rest is for the next call


def _checked(path: Path, sha256: str | None, part_bytes: int) -> LocalFile:
    """A file of the release, which is what the manifest vouches for."""
    try:
        file = look_at(path, part_bytes)
    except FileNotFoundError as error:
        raise IntegrityError(f"{path} is missing; pack the release again, and publish it then") from error
    if sha256 not in (None, file.sha256):
        raise IntegrityError(
            f"{path} must have sha256 {sha256}, found {file.sha256}: it was changed since it was packed; nothing of it "
            "was published. Pack the release again"
        )
    return file


def _send(target: Target, name: str, file: LocalFile) -> _Sent:
    return _Sent(name=name, file=file, was_sent=send(target, name, file))


def _remove_others(target: Target, files: ReleaseFiles) -> None:
    """Remove shards of a release that was there before."""
    for name in target.store.names():
        if is_shard_name(name) and name not in files.vouched:
            target.remove(name)


def _published(target: Target, files: ReleaseFiles, sent: list[_Sent]) -> Published:
    said = {one.name: PublishedFile(size_bytes=one.file.size_bytes, checksum=target.checksum(one.name)) for one in sent}
    return Published(release=files.digest, files=dict(sorted(said.items())))
