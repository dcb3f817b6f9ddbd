"""Archives that no honest tool would write, and some that it would."""

import gzip
import io
import tarfile
import zipfile

from box_room import along_x, scene_files
from hostile.case import Hostile
from hostile.files import DIGITS, GIB, archive_of, bomb, with_sizes_of_8_gib

GROUP = "box_d435i"


def members(root="bad/"):
    """A sound scene as members of an archive."""
    return [(root + name, data) for name, data in sorted(scene_files({0: along_x(y_m=1.1)}).items())]


def archive(name, refused, make, file="bad.tar.gz"):
    """An archive; `make` gives its bytes."""
    return Hostile(name=name, plant=lambda path: path.write_bytes(make()), refused=refused, place=f"{GROUP}/{file}")


def typed(kind, **fields):
    """Makes the first image of colour a member of another type."""

    def change(info):
        if info.name.endswith("_003.jpg"):
            info.type, info.size = kind, 0
            for key, value in fields.items():
                setattr(info, key, value)

    return change


def packed(**options):
    return gzip.compress(archive_of(*members(), **options), 1)


def climbing(name):
    return lambda: gzip.compress(archive_of((name, b"text"), *members()), 1)


def pax(**headers):
    def change(info):
        if info.name.endswith("_003.jpg"):
            info.pax_headers = headers

    return lambda: packed(change=change)


def zipped():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("bad/data/a.txt", "a")
    return buffer.getvalue()


def with_type(data, kind):
    """The first header of a tar made into one of another type, with a sound checksum, and no end of archive."""
    header = bytearray(data[:512])
    header[156:157] = kind
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\x00 " % sum(header)
    return bytes(header)


def sparse_8_gib(path):
    """A colour image of 8 GiB of zeros, which takes no room: a hole in a tar that is not compressed."""
    image = "bad/videos/chunk-000/observation.images.rgb/episode_000000_000.jpg"
    others = [(name, data) for name, data in members() if name != image]
    with path.open("wb") as file:
        file.write(with_sizes_of_8_gib(archive_of((image, b"")))[:512])
        file.truncate(512 + 8 * GIB)
        file.seek(512 + 8 * GIB)
        file.write(archive_of(*others))


ARCHIVES = (
    archive("an empty archive", "archive.", lambda: b""),
    archive("a truncated archive", "archive.truncated", lambda: packed()[:-5_000]),
    archive("a zip under the name of a tar", "archive.", zipped),
    archive("a page of HTML under the name of a tar", "archive.", lambda: b"<!DOCTYPE html><html>not found</html>"),
    archive(
        "a pointer to the archive",
        "archive.pointer_file",
        lambda: b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
    ),
    archive("random bytes", "archive.", lambda: bytes(range(256)) * 100),
    archive("a piece of an archive", "archive.unread_form", lambda: packed()[:9_000], "bad.tar.gz.aa"),
    archive("a 7-zip", "archive.unread_form", lambda: b"7z\xbc\xaf\x27\x1c" + bytes(99), "bad.7z"),
    archive("a plain tar", "", lambda: archive_of(*members()), "bad.tar"),
    archive("an ending in capitals", "", packed, "bad.TAR.GZ"),
    archive("8 GiB of zeros", "container.no_episodes", bomb),
    archive("a member that climbs", "archive.unsafe_member", climbing("../../etc/passwd")),
    archive("a member with an absolute name", "archive.unsafe_member", climbing("/etc/passwd")),
    archive("a member that climbs within", "archive.unsafe_member", climbing("bad/../../x")),
    archive(
        "a device as colour image",
        "archive.unsafe_member",
        lambda: packed(change=typed(tarfile.CHRTYPE, devmajor=1, devminor=5)),
    ),
    archive("a pipe as colour image", "archive.unsafe_member", lambda: packed(change=typed(tarfile.FIFOTYPE))),
    archive(
        "a symbolic link as colour image",
        "archive.unsafe_member",
        lambda: packed(change=typed(tarfile.SYMTYPE, linkname="/dev/zero")),
    ),
    archive(
        "a hard link to a member",
        "archive.unsafe_member",
        lambda: packed(
            change=typed(tarfile.LNKTYPE, linkname="bad/videos/chunk-000/observation.images.rgb/episode_000000_002.jpg")
        ),
    ),
    archive(
        "a hard link out of the archive",
        "archive.",
        lambda: packed(change=typed(tarfile.LNKTYPE, linkname="../../etc/passwd")),
    ),
    archive(
        "a volume label",
        "",
        lambda: gzip.compress(with_type(archive_of(("label", b"")), b"V") + archive_of(*members()), 1),
    ),
    archive("a pax size of 5,000 digits", "archive.corrupt", pax(size=DIGITS.decode())),
    archive("a pax size below nothing", "archive.corrupt", pax(size="-512")),
    archive("a pax path that climbs", "archive.unsafe_member", pax(path="../../../x.jpg")),
    archive("a pax time of 5,000 digits", "", pax(mtime=DIGITS.decode())),
    archive(
        "a member that declares 8 GiB and has none",
        "archive.truncated",
        lambda: gzip.compress(with_sizes_of_8_gib(archive_of(("bad/meta/episodes.jsonl", b""))), 1),
    ),
    Hostile(
        name="a colour image of 8 GiB of zeros in a tar",
        plant=sparse_8_gib,
        refused="file.too_large",
        place=f"{GROUP}/bad.tar",
    ),
    archive(
        "a scene at another depth under the archive's name",
        "",
        lambda: gzip.compress(archive_of(*members("a/b/c/bad/")), 1),
    ),
    archive(
        "a scene at another depth under another name",
        "container.no_episodes",
        lambda: gzip.compress(archive_of(*members("a/b/c/other/")), 1),
    ),
    archive(
        "names with backslashes",
        "container.no_episodes",
        lambda: gzip.compress(archive_of(*((name.replace("/", "\\"), data) for name, data in members())), 1),
    ),
    archive(
        "two scenes", "container.several_scenes", lambda: gzip.compress(archive_of(*members(), *members("worse/")), 1)
    ),
    archive("a member twice", "episode.duplicate", lambda: gzip.compress(archive_of(*members(), members()[0]), 1)),
    archive(
        "a name that is not UTF-8",
        "frame.missing",
        lambda: packed(change=lambda info: setattr(info, "name", info.name.replace("_003.jpg", "_\udcff.jpg"))),
    ),
)
