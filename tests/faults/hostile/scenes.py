"""Scenes of InternData-N1 with one hostile file each."""

import os

from box_room import DEPTH, RGB, along_x, scene_files, write_folder
from hostile.case import Hostile
from hostile.files import (
    DEEP,
    DIGITS,
    bound_socket,
    changed,
    hole,
    jpeg_declaring,
    link,
    nested_list,
    pipe,
    png_declaring,
    renamed,
    replaced,
    table_of,
)

GROUP = "box_d435i"
COLOUR, DEPTH_IMAGE = f"{RGB}/episode_000000_003.jpg", f"{DEPTH}/episode_000000_003.png"
TABLE, CLOUD, LENGTHS = "data/chunk-000/episode_000000.parquet", "meta/pointcloud.ply", "meta/episodes.jsonl"
LINE = b'{"episode_index": 0, "length": 7}\n'


def scene(name, refused, *changes, at=None):
    """A sound scene, changed."""

    def plant(folder):
        write_folder(folder, scene_files({0: along_x(y_m=1.1)}))
        for change in changes:
            change(folder)

    return Hostile(name=name, plant=plant, refused=refused, place=at or f"{GROUP}/bad")


def _loop(folder):
    (folder / "videos/chunk-000/again").symlink_to(folder / "videos")


def _big_endian(data):
    return data.replace(b"binary_little_endian", b"binary_big_endian")


def _declares(points):
    def change(data):
        head, _, body = data.partition(b"element vertex ")
        return head + b"element vertex " + points + b"\n" + body.partition(b"\n")[2]

    return change


SCENES = (
    scene("a time stamp as frame number", "frame.missing", renamed(COLOUR, "episode_000000_1700000000000.jpg")),
    scene("a frame number of 17 digits", "frame.missing", renamed(COLOUR, f"episode_000000_{10**16}.jpg")),
    scene("a frame number of 200 digits", "frame.missing", renamed(COLOUR, f"episode_000000_{'9' * 200}.jpg")),
    scene("an episode number of 17 digits", "frame.missing", renamed(COLOUR, f"episode_{10**16}_003.jpg")),
    scene("a frame whose name is not UTF-8", "frame.missing", renamed(COLOUR, b"episode_000000_\xff003.jpg")),
    scene("a frame whose name has escape codes", "frame.missing", renamed(COLOUR, "\x1b[31m_003.jpg")),
    scene("a frame whose name has a line feed", "frame.missing", renamed(COLOUR, "episode_000000_003.jpg\n")),
    scene(
        "a scene whose name is not UTF-8", "container.unstorable_name", at=os.fsdecode(f"{GROUP}/".encode() + b"\xff")
    ),
    scene("a scene whose name has escape codes", "container.unstorable_name", at=f"{GROUP}/\x1b[2Jbad"),
    scene("a scene whose name has a line feed", "container.unstorable_name", at=f"{GROUP}/bad\nworse"),
    scene("a scene whose name has a backslash", "", at=f"{GROUP}/b\\ad"),
    scene("a scene with a name of 250 letters", "", at=f"{GROUP}/{'a' * 250}"),
    scene("a pipe as colour image", "file.not_regular", pipe(COLOUR)),
    scene("a pipe as depth image", "file.not_regular", pipe(DEPTH_IMAGE)),
    scene("a pipe as table", "file.not_regular", pipe(TABLE)),
    scene("a pipe as cloud", "file.not_regular", pipe(CLOUD)),
    scene("a pipe as list of lengths", "file.not_regular", pipe(LENGTHS)),
    scene("a socket as colour image", "file.not_regular", bound_socket(COLOUR)),
    scene("a link to /dev/zero as colour image", "file.not_regular", link(COLOUR, "/dev/zero")),
    scene("a link to /dev/zero as cloud", "file.not_regular", link(CLOUD, "/dev/zero")),
    scene("a link to /dev/zero as list of lengths", "file.not_regular", link(LENGTHS, "/dev/zero")),
    scene("a link to nothing as colour image", "file.unreadable", link(COLOUR, "nowhere.jpg")),
    scene("a link to itself as colour image", "file.unreadable", link(COLOUR, "episode_000000_003.jpg")),
    scene("a folder that holds a link to a folder above it", "file.link_loop", _loop),
    scene("a colour image of 8 GiB", "file.too_large", hole(COLOUR, 8 << 30)),
    scene("a table of 8 GiB", "file.too_large", hole(TABLE, 8 << 30)),
    scene("a cloud of 8 GiB", "file.too_large", hole(CLOUD, 8 << 30)),
    scene("lengths of 8 GiB", "file.too_large", hole(LENGTHS, 8 << 30)),
    scene("an empty colour image", "frame.empty", replaced(COLOUR, b"")),
    scene("an empty depth image", "frame.empty", replaced(DEPTH_IMAGE, b"")),
    scene("an empty table", "table.unreadable", replaced(TABLE, b"")),
    scene("an empty cloud", "cloud.", replaced(CLOUD, b"")),
    scene(
        "a PNG that declares 20,000 x 20,000", "frame.too_large", replaced(DEPTH_IMAGE, png_declaring(20_000, 20_000))
    ),
    scene("a PNG that declares 2^31 - 1 squared", "frame.", replaced(DEPTH_IMAGE, png_declaring(2**31 - 1, 2**31 - 1))),
    scene("a PNG that declares no pixel", "frame.", replaced(DEPTH_IMAGE, png_declaring(0, 0))),
    scene("a JPEG that declares 65,535 x 65,535", "frame.too_large", replaced(COLOUR, jpeg_declaring(65_535, 65_535))),
    scene("a JPEG of zeros", "frame.", replaced(COLOUR, bytes(5_000))),
    scene("a table of 20 million rows", "table.too_large", replaced(TABLE, table_of(20_000_000))),
    scene("a table nested 60 lists deep", "table.", replaced(TABLE, nested_list(60))),
    scene("a table cut in half", "table.unreadable", changed(TABLE, lambda data: data[: len(data) // 2])),
    scene(
        "a table whose footer declares 4 GiB",
        "table.unreadable",
        changed(TABLE, lambda data: data[:-8] + b"\xff\xff\xff\xffPAR1"),
    ),
    scene("lengths nested 100,000 deep", "", replaced(LENGTHS, DEEP)),
    scene("a length of 5,000 digits", "", replaced(LENGTHS, LINE.replace(b"7", DIGITS))),
    scene("a length of infinity", "", replaced(LENGTHS, LINE.replace(b"7", b"1e999"))),
    scene("a key that stands twice in the lengths", "", replaced(LENGTHS, LINE.replace(b"{", b'{"length": 9, '))),
    scene("lengths with a byte order mark", "", replaced(LENGTHS, b"\xef\xbb\xbf" + LINE)),
    scene("lengths in UTF-16", "", replaced(LENGTHS, LINE.decode().encode("utf-16"))),
    scene("lengths of bytes that are no text", "", replaced(LENGTHS, b"\xff\x00\xfe" * 100)),
    scene(
        "lengths that name 10^15 episodes",
        "episode.missing",
        replaced(LENGTHS, LINE.replace(b": 0", b": 1000000000000000")),
    ),
    scene("a cloud in the other order of bytes", "cloud.", changed(CLOUD, _big_endian)),
    scene("a cloud that declares 10^12 points", "cloud.", changed(CLOUD, _declares(b"1000000000000"))),
    scene("a cloud that declares 5,000 digits of points", "cloud.", changed(CLOUD, _declares(DIGITS))),
    scene("a cloud that declares -1 points", "cloud.", changed(CLOUD, _declares(b"-1"))),
    scene("a cloud without the end of its header", "cloud.", replaced(CLOUD, b"ply\n" + b"comment a\n" * 100_000)),
)
