"""Frames per second of a LeRobot video through the reader, against PyAV alone on the same file.

Ours is what `wsm encode` pays for colour: a digest of the stored bytes, then every frame at the time that the table
says, found, compared with the limits and converted. PyAV alone opens the same file, decodes it and converts each
frame, nothing checked. Run as `python bench/video.py`.
"""

import statistics
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from generated_room import HEIGHT, WIDTH, room_video, sensor
from reporting import machine, machine_line, table, write_results

from wsm_data.readers.lerobot.video import VideoPart, decoded, packets_digest, rgb_u8

FPS = 30
FRAMES = 90
ROUNDS = 9
CODECS = {"libx264": {"crf": "23", "g": "2"}, "libsvtav1": {"crf": "30", "g": "2", "preset": "12"}}
"""As LeRobot encodes: a key frame every other frame."""


def write_video(path: Path, codec: str) -> None:
    light, _ = room_video(seed=3, frames=FRAMES)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS, options=CODECS[codec])
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for number, image in enumerate(sensor(light, 4.0)):
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, FPS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def pyav_alone(path: Path) -> int:
    with av.open(str(path)) as container:
        return sum(len(frame.to_ndarray(format="rgb24")) > 0 for frame in container.decode(video=0))


def our_path(path: Path) -> int:
    times_s = np.arange(FRAMES) / FPS
    part = VideoPart(path=path, where="bench", times_s=times_s, tolerance_s=0.4 / FPS, max_pixels=1 << 24)
    packets_digest(part)
    return sum(len(image) > 0 for image in decoded(part, rgb_u8))


def seconds(function, path: Path) -> float:
    start = time.process_time()
    assert function(path) == FRAMES
    return time.process_time() - start


def measure() -> dict:
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for codec in CODECS:
            path = Path(folder) / f"{codec}.mp4"
            write_video(path, codec)
            pairs = [(seconds(pyav_alone, path), seconds(our_path, path)) for _ in range(ROUNDS)]  # side by side
            bare, ours = (statistics.median(one) for one in zip(*pairs, strict=True))
            share = statistics.median(one / other for one, other in pairs)
            found[codec] = {"pyav_fps": FRAMES / bare, "ours_fps": FRAMES / ours, "share": share}
    return found


def main() -> None:
    setup, videos = machine("av", "numpy"), measure()
    rows = [
        [codec, f"{one['pyav_fps']:.0f}", f"{one['ours_fps']:.0f}", f"{one['share']:.2f}"]
        for codec, one in videos.items()
    ]
    lines = [
        "# Frames per second of LeRobot videos",
        "",
        f"{FRAMES} generated frames of {WIDTH}x{HEIGHT}, a key frame every other one, decoded to RGB; processor time, "
        f"medians of {ROUNDS} rounds side by side. Ours digests the stored bytes in a pass of its own, finds frames by "
        "their times and compares them with the limits; PyAV alone decodes and converts. The goal is a ratio of 0.8.",
        "",
        *table(["codec", "PyAV alone, frames/s", "reader, frames/s", "ratio"], rows),
        "",
        machine_line(setup),
    ]
    write_results("video", {"machine": setup, "cases": videos}, lines)


if __name__ == "__main__":
    main()
