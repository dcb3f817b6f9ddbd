"""The videos of a LeRobot data set: colour as H.264, codes of depth as HEVC of 12 bits without loss."""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from wsm_data.readers.lerobot.video import import_av
from wsm_data.schema.arrays import Uint8Array, Uint16Array


@dataclass(frozen=True, kw_only=True)
class VideoFormat:
    """How a video is encoded; with one thread, so that the bytes do not depend on the machine's cores.

    Attributes:
        encoder: FFmpeg's name of the encoder.
        codec: what LeRobot calls it.
        pixels: FFmpeg's name of the pixel format.
        channels: of a frame.
        options: of the encoder. Every second frame is a key frame, as LeRobot writes them: any is soon decoded.
    """

    encoder: str
    codec: str
    pixels: str
    channels: int
    options: tuple[tuple[str, str], ...]


COLOUR = VideoFormat(
    encoder="libx264",
    codec="h264",
    pixels="yuv420p",
    channels=3,
    options=(("crf", "18"), ("g", "2"), ("threads", "1")),
)
DEPTH = VideoFormat(
    encoder="libx265",
    codec="hevc",
    pixels="gray12le",
    channels=1,
    options=(
        ("preset", "veryfast"),
        ("x265-params", "lossless=1:log-level=none:pools=none:frame-threads=1"),
        ("g", "2"),
        ("threads", "1"),
    ),
)


class VideoWriter:
    """A video that grows episode by episode; frame n is shown at n / fps seconds.

    Args:
        path: the MP4, which must not be there; its folder is made.
        video: how it is encoded.
        size: width and height, px.
        fps: frames a second.
    """

    def __init__(self, path: Path, video: VideoFormat, size: tuple[int, int], fps: int):
        path.parent.mkdir(parents=True, exist_ok=True)
        self._av, self._format, self._period = import_av(), video, Fraction(1, fps)
        self._container = self._av.open(str(path), "w")
        self._stream = self._container.add_stream(video.encoder, rate=fps, options=dict(video.options))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt, self._stream.time_base = video.pixels, self._period
        self.frames = 0
        self.size_bytes = 0

    def add(self, images: Iterable[Uint8Array | Uint16Array]) -> None:
        """Append frames: colour [H, W, 3], or codes of depth [H, W]."""
        for image in images:
            frame = self._frame(image)
            frame.pts, frame.time_base = self.frames, self._period
            self._write(frame)
            self.frames += 1

    def close(self) -> None:
        """Finish the file."""
        self._write(None)
        self._container.close()

    def _frame(self, image: Uint8Array | Uint16Array) -> Any:
        if image.ndim == 3:
            return self._av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        height, width = image.shape
        frame = self._av.VideoFrame(width, height, self._format.pixels)
        plane = np.zeros((height, frame.planes[0].line_size // 2), "<u2")  # rows are padded
        plane[:, :width] = image
        frame.planes[0].update(plane.tobytes())
        return frame

    def _write(self, frame: Any) -> None:
        for packet in self._stream.encode(frame):
            self.size_bytes += packet.size
            self._container.mux(packet)
