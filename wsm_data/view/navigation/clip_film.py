"""A film of one clip: colour, depth in colours, and the way on the map, all in step."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from wsm_data.codecs.base import VideoCodec
from wsm_data.schema.clip import Clip
from wsm_data.view.clip.facts import world_path_m
from wsm_data.view.clip.pictures import decode_pictures
from wsm_data.view.navigation.film import FilmFrame, write_film


def write_clip_film(clip: Clip, codec: VideoCodec, path: Path) -> int:
    """Write a clip as an MP4; padded still frames at its end are left out.

    A release keeps no times, so a film runs as one of the simulator does, at 20 frames in three seconds.

    Args:
        clip: what is shown.
        codec: the codec the clip was encoded with.
        path: ends in .mp4; replaced as a whole.

    Returns:
        How many frames were written.

    Raises:
        ConfigError: the clip was encoded with another codec.
        OSError: this OpenCV cannot write such a film there.
    """
    return write_film(path, clip.grid, np.array(clip.meta.goal_world_m[:2]), clip_film_frames(clip, codec))


def clip_film_frames(clip: Clip, codec: VideoCodec) -> Iterator[FilmFrame]:
    """One frame for each raw frame that is not padded; nothing stands beside the colour where there is no depth."""
    count = clip.meta.recorded_frames
    pictures, way_m = decode_pictures(clip, codec, range(count)), world_path_m(clip)[:, :2]
    for number in range(count):
        yield FilmFrame(
            seen_u8=pictures.rgb_u8[number],
            beside_u8=pictures.depth_u8[number] if clip.has_depth else None,
            true_m=way_m[: number + 1],
            estimated_m=np.empty((0, 2)),
            caption=(
                clip.meta.key,
                f"frame {number + 1} of {count}",
                f"{clip.expert_distance[number]:.2f} m to the goal region",
            ),
        )
