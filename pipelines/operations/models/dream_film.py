"""A film of a dream: the true frames beside the dreamed ones, and the true and the estimated way on the map."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipelines.training.pictures import DreamedClip
from wsm_data.geometry.transform import transform_points
from wsm_data.loaders.batches.batch import Batch
from wsm_data.schema.clip import Clip
from wsm_data.schema.sequence import frames_of
from wsm_data.view.clip.facts import world_path_m
from wsm_data.view.navigation.film import FilmFrame, write_film
from wsm_model.evaluation.decoding import Decoding
from wsm_model.losses.pose import raw_frame_poses


def write_dream_film(path: Path, clip: Clip, batch: Batch, decoding: Decoding, dreamed: DreamedClip) -> int:
    """Write an MP4 of what was seen and dreamed; replaced as a whole.

    Returns:
        How many frames were written.

    Raises:
        OSError: this OpenCV cannot write such a film there.
    """
    goal_m = np.array(clip.meta.goal_world_m[:2])
    return write_film(path, clip.grid, goal_m, dream_film_frames(clip, batch, decoding, dreamed))


def dream_film_frames(clip: Clip, batch: Batch, decoding: Decoding, dreamed: DreamedClip) -> Iterator[FilmFrame]:
    """One frame for each raw frame that was seen or dreamed; nothing stands beside one that was seen."""
    true_u8, dreamed_u8 = decoding.rgb_u8(batch.rgb[0, : dreamed.end]), decoding.rgb_u8(dreamed.rgb)
    true_m = world_path_m(clip)[:, :2]
    camera0_m = raw_frame_poses(dreamed.poses.float())[:, :3].double().cpu().numpy()
    estimated_m = transform_points(clip.meta.T_world_camera0_matrix, camera0_m)[:, :2]
    first = frames_of(dreamed.seen)
    for number in range(len(true_u8)):
        is_dreamed = number >= first
        yield FilmFrame(
            seen_u8=true_u8[number],
            beside_u8=dreamed_u8[number] if is_dreamed else None,
            true_m=true_m[: number + 1],
            estimated_m=estimated_m[: number + 1],
            caption=(clip.meta.key, f"frame {number}", "dreamed" if is_dreamed else "seen"),
        )
