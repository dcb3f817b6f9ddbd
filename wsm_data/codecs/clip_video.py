"""From the stored frames of an episode to what a codec encodes."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import DTypeLike

from wsm_data.codecs.depth import UNMEASURED, log_depth_table, measured_table
from wsm_data.codecs.images import depth_codes, rgb_pixels
from wsm_data.codecs.resize import resize_colour, resize_depth
from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import BoolArray, Float32Array, Uint8Array, Uint16Array
from wsm_data.schema.depth import DepthEncoding, DepthRange
from wsm_data.schema.frames import DepthFrame, RgbFrame
from wsm_data.schema.sequence import TEMPORAL_RATIO

_Image = TypeVar("_Image", Uint8Array, Uint16Array)

_RESERVED = 4
"""How many times the first video's memory is reserved; trajectories of a source differ by less in length."""


class VideoMemory:
    """Memory that the videos of one trajectory after another are decoded into.

    A clip's videos are some 200 MB; asking the system for new pages for each costs as much as decoding the frames.
    So more is reserved than is asked for: pages that are never written to are only numbers, and a longer trajectory
    finds the others as they were.
    """

    def __init__(self) -> None:
        self._held: dict[str, np.ndarray] = {}

    def array(self, name: str, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
        """An array of undefined content that shares memory with the last one of this name."""
        size = int(np.prod(shape))
        held = self._held.get(name)
        if held is None or held.dtype != np.dtype(dtype) or len(held) < size:
            held = self._held[name] = np.empty(_RESERVED * size, dtype)
        return held[:size].reshape(shape)


def rgb_video(
    frames: Sequence[RgbFrame],
    width: int,
    height: int,
    where: str,
    length: int | None = None,
    memory: VideoMemory | None = None,
) -> Float32Array:
    """Decode and resize the colour frames of an episode.

    Args:
        frames: the T colour images in time order.
        width: encoded width, px.
        height: encoded height, px.
        where: the episode, for messages; the number of the frame is added to it.
        length: frames of the video, T where None; the last frame is repeated as in `pad_frames`, without a copy of all.
        memory: where the video is put, and stays until the next one is; memory of its own where None.

    Returns:
        float32 [length, height, width, 3] in [-1, 1]: area means over 127.5, less 1.

    Raises:
        DataError: FRAME_UNDECODABLE; FRAME_SIZE_MISMATCH where a frame's size differs from the first one's.
    """
    memory = memory or VideoMemory()
    video = memory.array("rgb", (_padded_count(frames, length), height, width, 3), np.float32)
    decoded = ((index, rgb_pixels(one, _frame_name(where, "colour", index))) for index, one in enumerate(frames))
    for index, rgb_u8 in _of_one_size(decoded, where, "colour"):
        resize_colour(rgb_u8, video[index])
    video[len(frames) :] = video[len(frames) - 1]
    return video


def depth_video(
    frames: Sequence[DepthFrame | None],
    encoding: DepthEncoding,
    depth_range: DepthRange,
    width: int,
    height: int,
    where: str,
    length: int | None = None,
    memory: VideoMemory | None = None,
) -> tuple[Float32Array, BoolArray]:
    """Decode, resize and normalise the depth frames of an episode.

    Args:
        frames: the T depth images in time order, None where a frame has none: nothing is measured there.
        encoding: how the source stores depth.
        depth_range: metric range of the log-depth normalisation.
        width: encoded width, px.
        height: encoded height, px.
        where: the episode, for messages; the number of the frame is added to it.
        length: frames of the video, T where None; the last frame is repeated as in `pad_frames`, without a copy of all.
        memory: where the video is put, and stays until the next one is; memory of its own where None.

    Returns:
        The log-depth video, float32 [length, height, width, 3] in [-1, 1], a read-only view that repeats one channel;
        and which pixels hold a measurement, bool [length, height, width].

    Raises:
        DataError: FRAME_UNDECODABLE, DEPTH_NOT_16_BIT; FRAME_SIZE_MISMATCH where a frame's size differs from the
            first one's.
    """
    normalised, measured = log_depth_table(encoding, depth_range), measured_table(encoding)
    memory = memory or VideoMemory()
    channel = memory.array("depth", (_padded_count(frames, length), height, width), np.float32)
    valid = memory.array("valid", channel.shape, np.bool_)
    absent = [index for index, one in enumerate(frames) if one is None]
    channel[absent], valid[absent] = UNMEASURED, False
    decoded = (
        (index, depth_codes(one, _frame_name(where, "depth", index)))
        for index, one in enumerate(frames)
        if one is not None
    )
    for index, raw_u16 in _of_one_size(decoded, where, "depth"):
        resize_depth(raw_u16, normalised, measured, channel[index], valid[index])
    for video in (channel, valid):
        video[len(frames) :] = video[len(frames) - 1]
    return _three_channels(channel), valid


def padded_length(frames: int, still_frames: int) -> int:
    """Length of a clip of `frames` raw frames: the next 1 + 4k, then `still_frames` more.

    Raises:
        ValueError: there is no frame, or `still_frames` is not a whole number of latents.
    """
    if frames < 1 or still_frames < 0 or still_frames % TEMPORAL_RATIO:
        raise ValueError(
            f"padding needs at least one frame and a multiple of {TEMPORAL_RATIO} still frames, "
            f"found {frames} and {still_frames}"
        )
    return frames + (1 - frames) % TEMPORAL_RATIO + still_frames


def pad_frames(video: np.ndarray, frames: int) -> np.ndarray:
    """Repeat the last entry of the first axis until there are `frames`; a broadcast last axis stays one.

    Raises:
        ValueError: the video is empty or longer than `frames`.
    """
    if not 0 < len(video) <= frames:
        raise ValueError(f"only a video of 1 to {frames} frames can be padded to {frames}, found {len(video)}")
    if video.ndim == 4 and video.strides[-1] == 0:
        return _three_channels(pad_frames(video[..., 0], frames))
    padded = np.empty((frames, *video.shape[1:]), video.dtype)
    padded[: len(video)] = video
    padded[len(video) :] = video[-1]
    return padded


def _padded_count(frames: Sequence[RgbFrame | DepthFrame | None], length: int | None) -> int:
    count = len(frames) if length is None else length
    if not 0 < len(frames) <= count:
        raise ValueError(f"a video of {count} frames is made of 1 to {count} images, found {len(frames)}")
    return count


def _three_channels(channel: Float32Array) -> Float32Array:
    return np.broadcast_to(channel[..., None], (*channel.shape, 3))


def _frame_name(where: str, kind: str, index: int) -> str:
    return f"{where}, {kind} frame {index}"


def _of_one_size(images: Iterator[tuple[int, _Image]], where: str, kind: str) -> Iterator[tuple[int, _Image]]:
    """Pass numbered images on; refuse the first whose height or width differs from that of the first one."""
    first: tuple[int, tuple[int, ...]] | None = None
    for index, image in images:
        size = image.shape[:2]
        first = first or (index, size)
        if size != first[1]:
            message = (
                f"{_frame_name(where, kind, index)}: all frames of an episode must have one size, found "
                f"{size[1]}x{size[0]} px after {first[1][1]}x{first[1][0]} px in frame {first[0]}; repair the source"
            )
            raise DataError(Reason.FRAME_SIZE_MISMATCH, message, {"frame": index, "size_px": [size[1], size[0]]})
        yield index, image
