"""Sequences in TUM's layout, and episodes written from arrays, with one hostile file each."""

import json

import numpy as np
from box_room import INTRINSICS, along_x, colours, depth_m, encoded
from hostile.case import Hostile
from hostile.files import DEEP, DIGITS, changed, hole, jpeg_declaring, link, pipe, png_declaring, replaced
from scipy.spatial.transform import Rotation

from wsm_data.readers.arrays import write_episode

DRIVE = along_x(y_m=1.1, frames=8, step_m=0.2)


def sequence(name, refused, *changes):
    """A sound sequence of eight frames, changed."""

    def plant(folder):
        write_sequence(folder)
        for change in changes:
            change(folder)

    return Hostile(name=f"tum: {name}", plant=plant, refused=refused, place="bad")


def write_sequence(folder, drive=DRIVE):
    """A drive as rgb.txt, depth.txt, groundtruth.txt, camera.txt and their images; a frame every 0.1 s."""
    lines = {"rgb": [], "depth": [], "groundtruth": []}
    for frame, (rgb, T) in enumerate(zip(colours(drive), drive.T_world_camera, strict=True)):
        stamp = f"{100 + 0.1 * frame:.6f}"
        codes = np.rint(depth_m(drive.room, T) * 5000).astype(np.uint16)
        for kind, image in (("rgb", rgb[..., ::-1]), ("depth", codes)):
            (folder / kind).mkdir(parents=True, exist_ok=True)
            (folder / kind / f"{stamp}.png").write_bytes(encoded(".png", image))
            lines[kind].append(f"{stamp} {kind}/{stamp}.png")
        pose = [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]
        lines["groundtruth"].append(" ".join([stamp, *map(repr, map(float, pose))]))
    for kind, text in lines.items():
        (folder / f"{kind}.txt").write_text("\n".join(text) + "\n")
    camera = INTRINSICS
    (folder / "camera.txt").write_text(f"{camera.fx} {camera.fy} {camera.cx} {camera.cy}\n")


def episode(name, refused, change):
    """A sound episode of eight frames, whose episode.json or other file is changed."""

    def plant(folder):
        write_arrays(folder)
        change(folder)

    return Hostile(name=f"arrays: {name}", plant=plant, refused=refused, place="bad")


def write_arrays(folder, drive=DRIVE):
    """A drive as `write_episode` stores it."""
    depths = [depth_m(drive.room, T).astype(np.float32) for T in drive.T_world_camera]
    frames = zip(colours(drive), depths, drive.T_world_camera, strict=True)
    write_episode(folder.parent, folder.name, "one", frames, K=INTRINSICS.matrix, camera="cam", floor_z_m=0.0)


def said(**values):
    """Other values in episode.json."""
    return changed("one/episode.json", lambda data: json.dumps({**json.loads(data), **values}).encode())


def swapped(old, new):
    return changed("one/episode.json", lambda data: data.replace(old, new, 1))


POSES, STAMP = "groundtruth.txt", b"100.300000 "
FRAME = "rgb/100.300000.png"

SEQUENCES = (
    sequence("nothing hostile", ""),
    sequence(
        "a pose that is not a number",
        "trajectory.unreadable",
        changed(POSES, lambda data: data.replace(b"1.1", b"nan")),
    ),
    sequence(
        "a position of infinity", "trajectory.unreadable", changed(POSES, lambda data: data.replace(b"1.1", b"inf"))
    ),
    sequence("a position of 1e308", "pose.", changed(POSES, lambda data: data.replace(b"1.1", b"1e308", 1))),
    sequence(
        "rotations of length nothing",
        "trajectory.unreadable",
        changed(POSES, lambda data: b"".join(line.rsplit(b" ", 4)[0] + b" 0 0 0 0\n" for line in data.splitlines())),
    ),
    sequence(
        "a time of 5,000 digits", "sequence.", changed("rgb.txt", lambda data: data.replace(STAMP, DIGITS + b" "))
    ),
    sequence("a time that is not a number", "sequence.", changed("rgb.txt", lambda data: data.replace(STAMP, b"nan "))),
    sequence(
        "a time that stands twice",
        "sequence.unreadable",
        changed("rgb.txt", lambda data: data.replace(STAMP, b"100.200000 ")),
    ),
    sequence("poses in UTF-16", "sequence.unreadable", changed(POSES, lambda data: data.decode().encode("utf-16"))),
    sequence(
        "poses with a byte order mark", "trajectory.unreadable", changed(POSES, lambda data: b"\xef\xbb\xbf" + data)
    ),
    sequence("poses of bytes that are no text", "sequence.unreadable", replaced(POSES, b"\xff\x00\xfe" * 100)),
    sequence("an empty list of poses", "trajectory.unreadable", replaced(POSES, b"")),
    sequence("poses of 8 GiB", "file.too_large", hole(POSES, 8 << 30)),
    sequence("a pipe as list of poses", "file.not_regular", pipe(POSES)),
    sequence("a link to /dev/zero as list of images", "file.not_regular", link("rgb.txt", "/dev/zero")),
    sequence(
        "an image that climbs",
        "sequence.unreadable",
        changed("rgb.txt", lambda data: data.replace(FRAME.encode(), b"../../etc/passwd")),
    ),
    sequence(
        "an image with an absolute name",
        "sequence.unreadable",
        changed("rgb.txt", lambda data: data.replace(FRAME.encode(), b"/dev/zero")),
    ),
    sequence(
        "an image whose name has escape codes",
        "file.unreadable",
        changed("rgb.txt", lambda data: data.replace(FRAME.encode(), b"rgb/\x1b[2J.png")),
    ),
    sequence("a pipe as colour image", "file.not_regular", pipe(FRAME)),
    sequence(
        "a PNG that declares 20,000 x 20,000",
        "frame.",
        replaced(FRAME.replace("rgb", "depth"), png_declaring(20_000, 20_000)),
    ),
    sequence("a JPEG that declares 65,535 x 65,535", "frame.", replaced(FRAME, jpeg_declaring(65_535, 65_535))),
    sequence("a focal length of nothing", "intrinsics.misfit", replaced("camera.txt", b"0 0 31.5 23.5\n")),
    sequence(
        "a focal length that is not a number", "intrinsics.misfit", replaced("camera.txt", b"nan nan 31.5 23.5\n")
    ),
    sequence("a camera of 10,000 numbers", "sequence.unreadable", replaced("camera.txt", b"1 " * 10_000)),
)

EPISODES = (
    episode("nothing hostile", "", lambda _: None),
    episode("nested 100,000 deep", "sequence.unreadable", replaced("one/episode.json", DEEP)),
    episode("a floor of 5,000 digits", "sequence.unreadable", swapped(b'"floor_z_m": 0.0', b'"floor_z_m": ' + DIGITS)),
    episode("a floor that is not a number", "sequence.unreadable", said(floor_z_m=float("nan"))),
    episode("a floor of 1e308", "mount.misfit", said(floor_z_m=1e308)),
    episode("a camera with escape codes in its name", "sequence.unreadable", said(camera="\x1b[2J")),
    episode("a camera that is a list", "sequence.unreadable", said(camera=[1, 2])),
    episode("K of zeros", "sequence.unreadable", said(K=[[0] * 3] * 3)),
    episode("K of text", "sequence.unreadable", said(K="none")),
    episode("poses of 15 numbers", "sequence.unreadable", said(T_world_camera=[[0.0] * 15] * 8)),
    episode("poses that are not numbers", "pose.not_finite", said(T_world_camera=[[float("nan")] * 16] * 8)),
    episode("no object at all", "sequence.unreadable", replaced("one/episode.json", b"[]")),
    episode("a byte order mark", "", changed("one/episode.json", lambda data: b"\xef\xbb\xbf" + data)),
    episode("a key that stands twice", "", swapped(b"{", b'{"floor_z_m": 9.0, ')),
    episode("a pipe", "file.not_regular", pipe("one/episode.json")),
    episode("8 GiB", "file.too_large", hole("one/episode.json", 8 << 30)),
    episode(
        "a PNG that declares 20,000 x 20,000",
        "frame.",
        replaced("one/depth/000003.png", png_declaring(20_000, 20_000)),
    ),
    episode("an empty image", "frame.empty", replaced("one/rgb/000003.png", b"")),
)
