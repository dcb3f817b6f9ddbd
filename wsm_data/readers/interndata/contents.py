"""What one pass over a container leaves behind: facts about every file that is used, and only few of their bytes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.files.digest import xxh3_128
from wsm_data.readers.archive.member import Member
from wsm_data.readers.images import check_jpeg, check_png16, require_pixels
from wsm_data.readers.interndata.episode_meta import read_image_spans, read_lengths
from wsm_data.readers.interndata.naming import ImageSpan, Kind, Role, role_of
from wsm_data.readers.interndata.scene_files import iter_members, scene_cloud
from wsm_data.readers.interndata.table import EpisodeTable, read_table
from wsm_data.readers.interndata.unread import Unread
from wsm_data.readers.ply import read_point_cloud, require_finite_points
from wsm_data.readers.source import Container
from wsm_data.readers.unreadable import too_large
from wsm_data.schema.dataset import ReadLimits
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.source.layout import Layout

FrameKey = tuple[int | None, int]
"""Episode number and image number in an image's name; the first is None where names carry no episode."""


@dataclass(frozen=True, slots=True)
class ImageFacts:
    """What is kept of an image.

    Attributes:
        name: its name in the container.
        size: width and height, px; None when the file is refused.
        digest: xxh3_128 of the file.
        refusal: why the file cannot be used, if so.
    """

    name: str
    size: tuple[int, int] | None
    digest: str
    refusal: DataError | None


@dataclass
class FolderContents:
    """One scene, or one trajectory folder, while it is being read.

    Attributes:
        tables: by episode number, the table or why it cannot be used.
        rgb: colour images by name.
        depth: depth images by name.
        lengths: `length` of meta/episodes.jsonl by episode number.
        spans: `image_index` of meta/episodes_stats.jsonl by episode number.
        clouds: by file name, the cloud or why it cannot be used.
        depth_png: bytes of the depth images that a map may be fused from.
        limits: what is too large to be read.
        unread: what else is in the container.
    """

    limits: ReadLimits = field(default_factory=ReadLimits)
    unread: Unread = field(default_factory=Unread)
    tables: dict[int, EpisodeTable | DataError] = field(default_factory=dict)
    rgb: dict[FrameKey, ImageFacts] = field(default_factory=dict)
    depth: dict[FrameKey, ImageFacts] = field(default_factory=dict)
    lengths: dict[int, int] = field(default_factory=dict)
    spans: dict[int, ImageSpan] = field(default_factory=dict)
    clouds: dict[str, PointCloud | DataError] = field(default_factory=dict)
    depth_png: dict[FrameKey, bytes] = field(default_factory=dict)


@dataclass
class Contents:
    """All of a container: its trajectory folders by name, where "" is the container itself."""

    limits: ReadLimits = field(default_factory=ReadLimits)
    folders: dict[str, FolderContents] = field(default_factory=dict)
    unread: Unread = field(default_factory=Unread)
    bytes_read: int = 0

    def folder(self, name: str) -> FolderContents:
        """The trajectory folder of that name, empty where it is new."""
        return self.folders.setdefault(name, FolderContents(limits=self.limits, unread=self.unread))

    def wants(self, name: str) -> bool:
        """Whether a file is read; one that is not is counted."""
        if role_of(name) is not None:
            return True
        self.unread.note(name)
        return False

    @property
    def has_cloud(self) -> bool:
        """Whether any cloud was found, damaged or not."""
        return any(folder.clouds for folder in self.folders.values())

    def forget_depth(self) -> None:
        """Let the depth images go: there is a cloud."""
        for folder in self.folders.values():
            folder.depth_png.clear()


def read_contents(source: Path, container: Container, depth_sample_every: int, limits: ReadLimits) -> Contents:
    """Read a container once, from its first file to its last.

    Depth images are kept compressed until a cloud turns up, every `depth_sample_every`-th of them. Where their names
    are numbered through the whole scene, which frame one is shows only at the end, and all are kept until then.

    Raises:
        DataError: the container as a whole cannot be used.
    """
    contents = Contents(limits=limits)
    for member in iter_members(source, container, contents.wants, limits.max_file_bytes):
        role = role_of(member.name)
        if role is not None:
            folder = contents.folder(role.folder)
            _READ[role.kind](folder, role, member, f"{container.id}:{member.name}")
            contents.bytes_read += member.size
            if role.kind is Kind.DEPTH and not contents.has_cloud:
                _keep_depth(folder, role, member, depth_sample_every)
            elif role.kind is Kind.CLOUD:
                contents.forget_depth()
    if container.layout == Layout.TRAJECTORY_FOLDER and not contents.has_cloud:
        _take_scene_cloud(contents, source, container)
    return contents


def _take_scene_cloud(contents: Contents, source: Path, container: Container) -> None:
    """A trajectory without a cloud of its own has the cloud of its scene."""
    cloud = scene_cloud(source, container, contents.limits.max_file_bytes)
    if cloud is not None:
        folder = contents.folder("")
        _read_cloud(folder, _SCENE_CLOUD, cloud, f"{container.id}:{cloud.name}")
        contents.bytes_read += cloud.size
        contents.forget_depth()


_SCENE_CLOUD = Role(Kind.CLOUD, "", None, None)


def _keep_depth(folder: FolderContents, role: Role, member: Member, every: int) -> None:
    number = role.number or 0
    if role.episode is None or number % every == 0:
        folder.depth_png[role.episode, number] = bytes(member.data)


def _read_table(folder: FolderContents, role: Role, member: Member, where: str) -> None:
    number = role.episode or 0
    if number in folder.tables:
        folder.tables[number] = DataError(
            Reason.EPISODE_DUPLICATE,
            f"{where}: there must be one table for each episode, and another one has the number {number}; remove one",
            {"episode": number},
        )
        return
    try:
        folder.tables[number] = read_table(member.content(), where, folder.limits.max_frames)
    except DataError as error:
        folder.tables[number] = error


def _read_image(
    images: dict[FrameKey, ImageFacts],
    check: Callable[[memoryview, str], tuple[int, int]],
    max_pixels: int,
    role: Role,
    member: Member,
    where: str,
) -> None:
    key = (role.episode, role.number or 0)
    size, refusal = None, None
    try:
        if key in images:
            message = f"{where}: each frame must have one image, and {images[key].name} is the same frame; remove one"
            raise DataError(Reason.EPISODE_DUPLICATE, message, {"other": images[key].name})
        declared = check(member.content(), where)
        require_pixels(declared, max_pixels, where)
        size = declared
    except DataError as error:
        refusal = error
    images[key] = ImageFacts(member.name, size, xxh3_128(member.data), refusal)


def _read_cloud(folder: FolderContents, _role: Role, member: Member, where: str) -> None:
    try:
        cloud = read_point_cloud(bytes(member.content()))
        require_finite_points(cloud)
        folder.clouds[member.name] = cloud
    except DataError as error:
        folder.clouds[member.name] = DataError(error.reason, f"{where}: {error.message}", error.details)


def _read_lengths(folder: FolderContents, _role: Role, member: Member, where: str) -> None:
    folder.lengths.update(read_lengths(_lines_of(folder, member, where)))


def _read_spans(folder: FolderContents, _role: Role, member: Member, where: str) -> None:
    folder.spans.update(read_image_spans(_lines_of(folder, member, where)))


def _lines_of(folder: FolderContents, member: Member, where: str) -> memoryview:
    if member.size > folder.limits.max_json_bytes:
        raise too_large(where, member.size, folder.limits.max_json_bytes)
    return member.content()


_READ: Mapping[Kind, Callable[[FolderContents, Role, Member, str], None]] = {
    Kind.TABLE: _read_table,
    Kind.RGB: lambda folder, *rest: _read_image(folder.rgb, check_jpeg, folder.limits.max_image_pixels, *rest),
    Kind.DEPTH: lambda folder, *rest: _read_image(folder.depth, check_png16, folder.limits.max_image_pixels, *rest),
    Kind.CLOUD: _read_cloud,
    Kind.LENGTHS: _read_lengths,
    Kind.STATS: _read_spans,
}
