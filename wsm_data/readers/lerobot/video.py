"""Frames of an MP4 at given times, through PyAV (the extra `lerobot`), and a digest of the bytes they come from."""

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import xxhash

from wsm_data.errors import ConfigError, DataError, Reason
from wsm_data.readers.images import require_pixels
from wsm_data.readers.unreadable import open_file
from wsm_data.schema.arrays import Float64Array, Uint8Array, Uint16Array

_TWELVE_BITS = ("gray12le", "yuv420p12le")
"""Pixel formats whose first plane is depth of 12 bits."""

_REORDERED = 50
"""Key frames are looked for by when they are decoded, up to 16 frames before they are shown: so many tolerances earlier
one of them is surely early enough."""


@dataclass(frozen=True, kw_only=True)
class VideoPart:
    """Some frames of a video.

    Attributes:
        path: the file.
        where: what to call it in messages.
        times_s: when they are shown, rising, s; float64 [N], N >= 1.
        tolerance_s: a frame is taken for one that is shown at most so far away; below half of the time of a frame.
        max_pixels: of a frame.
    """

    path: Path
    where: str
    times_s: Float64Array
    tolerance_s: float
    max_pixels: int


def import_av() -> ModuleType:
    """PyAV.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        return importlib.import_module("av")
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"videos of LeRobot data sets need the package {error.name}; install the extra: pip install 'wsm[lerobot]'"
        ) from error


def decoded(part: VideoPart, pixels: Callable[[Any, str], np.ndarray]) -> Iterator[np.ndarray]:
    """Decode the frames one after the other, in the order of their times.

    Args:
        part: which frames.
        pixels: makes an array of a frame: `rgb_u8` or `depth_codes`.

    Raises:
        DataError: `file.unreadable`, `frame.undecodable`, `frame.too_large`, `frame.missing`.
    """
    wanted = part.times_s.tolist()
    with _opened(part) as (container, stream):
        number = 0
        for frame in container.decode(stream):
            if frame.pts is None:
                continue
            time_s = float(frame.pts * stream.time_base)
            if time_s > wanted[number] + part.tolerance_s:
                raise _missing(part, number, time_s)
            if time_s >= wanted[number] - part.tolerance_s:
                yield pixels(frame, part.where)
                number += 1
                if number == len(wanted):
                    return
        raise _missing(part, number, None)


def rgb_u8(frame: Any, where: str) -> Uint8Array:
    """Colour of a frame; uint8 [H, W, 3]."""
    del where
    return np.asarray(frame.to_ndarray(format="rgb24"))


def depth_codes(frame: Any, where: str) -> Uint16Array:
    """The codes of a depth frame as they are stored; uint16 [H, W].

    Raises:
        DataError: `depth.not_16_bit`: it does not have 12 bits.
    """
    if frame.format.name not in _TWELVE_BITS:
        raise DataError(
            Reason.DEPTH_NOT_16_BIT,
            f"{where}: a depth video must have 12 bits ({' or '.join(_TWELVE_BITS)}), found {frame.format.name}; one "
            "of 8 bits is a picture of depth, not a measurement",
            {"format": frame.format.name},
        )
    plane = frame.planes[0]
    rows = np.frombuffer(plane, np.dtype("<u2"), count=plane.line_size // 2 * frame.height)
    return rows.reshape(frame.height, -1)[:, : frame.width].astype(np.uint16)


def packets_digest(part: VideoPart) -> tuple[str, int]:
    """Digest of the stored bytes that the frames are decoded from, and how many they are.

    It is the same with every version of every decoder, which the pixels are not.

    Raises:
        DataError: `file.unreadable` or `frame.undecodable`.
    """
    digest, total = xxhash.xxh3_128(), 0
    last_s = float(part.times_s[-1]) + part.tolerance_s
    with _opened(part) as (container, stream):
        for packet in container.demux(stream):
            if packet.dts is not None and float(packet.dts * stream.time_base) > last_s:
                break
            data = bytes(packet)
            digest.update(data)
            total += len(data)
    return digest.hexdigest(), total


@contextmanager
def _opened(part: VideoPart) -> Iterator[tuple[Any, Any]]:
    """The file and its video, at a key frame before the first wanted time."""
    av = import_av()
    with open_file(part.path, part.where) as file:
        try:
            with av.open(file, mode="r", metadata_errors="replace") as container:
                stream = next(iter(container.streams.video), None)
                if stream is None or stream.time_base is None or stream.codec_context is None:
                    raise _undecodable(part, "it has no video of a codec that is known")
                require_pixels((stream.codec_context.width, stream.codec_context.height), part.max_pixels, part.where)
                start_s = float(part.times_s[0]) - _REORDERED * part.tolerance_s
                if start_s > 0:
                    container.seek(int(start_s / stream.time_base), stream=stream)
                yield container, stream
        except av.FFmpegError as error:
            raise _undecodable(part, str(error)) from error


def _undecodable(part: VideoPart, why: str) -> DataError:
    message = f"{part.where} must be a video that can be decoded, but {why}; fetch it again"
    return DataError(Reason.FRAME_UNDECODABLE, message, {"error": why})


def _missing(part: VideoPart, number: int, found_s: float | None) -> DataError:
    wanted = float(part.times_s[number])
    found = "the video ends" if found_s is None else f"the next one is at {found_s:.4f} s"
    return DataError(
        Reason.FRAME_MISSING,
        f"{part.where}: there must be a frame within {part.tolerance_s:.4f} s of {wanted:.4f} s, and {found}; do video "
        "and table belong together?",
        {"time_s": wanted, "frame": number},
    )
