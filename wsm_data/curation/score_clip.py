"""All scores of one clip."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsm_data.codecs.base import VideoCodec
from wsm_data.curation.path_outline import PATH_POINTS, path_outline
from wsm_data.curation.scorers.clip_images import images_of
from wsm_data.curation.scorers.registry import GEOMETRY_SCORERS, IMAGE_SCORERS
from wsm_data.curation.scorers.scorer import require_score
from wsm_data.curation.scorers.trajectory import Trajectory, trajectory_of
from wsm_data.curation.scores_table import ScorerInfo
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.clip import Clip

CLIP_SCORES: tuple[ScorerInfo, ...] = (
    *(one.info for one in GEOMETRY_SCORERS),
    *(one.info for one in IMAGE_SCORERS),
)
"""What every score of a clip says of itself, in the order of the columns."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipScores:
    """What is stored of one clip.

    Attributes:
        values: by the name of the score, in the order of `CLIP_SCORES`; NaN where a score is absent.
        outline_xy_m: outline of the path, world, m; float64 [32, 2].
        floor_z_m: height of the floor below the first camera, world z, m.
    """

    values: Mapping[str, float]
    outline_xy_m: Float64Array
    floor_z_m: float


def score_clip(clip: Clip, rgb_std: Float64Array, codec: VideoCodec | None, depth_samples: int) -> ClipScores:
    """Score one stored clip.

    Args:
        clip: the clip.
        rgb_std: standard deviation of each channel of the colour latents over the release; float64 [C].
        codec: see `images_of`.
        depth_samples: see `images_of`.

    Raises:
        ValueError: a scorer computed no number; that is its bug.
    """
    trajectory = trajectory_of(clip)
    images = images_of(clip, rgb_std, codec, depth_samples)
    of_images = {one.info.name: require_score(one.info, one.score(images), clip.meta.key) for one in IMAGE_SCORERS}
    return ClipScores(
        values=score_trajectory(trajectory, clip.meta.key) | of_images,
        outline_xy_m=path_outline(trajectory.path_xy_m, PATH_POINTS),
        floor_z_m=float(trajectory.T_world_camera[0, 2, 3]) - clip.meta.camera_height_m,
    )


def score_trajectory(trajectory: Trajectory, key: str) -> dict[str, float]:
    """The geometry scores of a trajectory by name, in the order of `GEOMETRY_SCORERS`; `key` names it in messages."""
    return {one.info.name: require_score(one.info, one.score(trajectory), key) for one in GEOMETRY_SCORERS}
