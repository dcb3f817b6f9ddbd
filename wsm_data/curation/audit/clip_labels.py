"""What a clip is supervised by, read without its latents: where it starts and ends, how far that is, on which map."""

from dataclasses import dataclass

import numpy as np

from wsm_data.access.release import Release
from wsm_data.curation.path_outline import PATH_POINTS, path_outline
from wsm_data.errors import IntegrityError
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.clip_meta import ClipMeta, parse_meta
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.members import META, STORED_DTYPES

_LABELS = ("poses", "expert_distance", META)


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipLabels:
    """Labels of one clip.

    Attributes:
        row: its row of the index.
        outline_xy_m: evenly spaced points of its path, padding left out, world, m; float64 [32, 2].
        start_m: point on the floor below the first camera, world, m; float64 [3].
        goal_m: point on the floor below the last camera, world, m; float64 [3].
        expert_distance_m: geodesic distance from start to goal region, m.
        robot_radius_m: radius of the footprint for which it was computed, m.
        map_digest: digest of the level of the map it was computed on.
    """

    row: IndexRow
    outline_xy_m: Float64Array
    start_m: Float64Array
    goal_m: Float64Array
    expert_distance_m: float
    robot_radius_m: float
    map_digest: str


def read_labels(release: Release, row: IndexRow) -> ClipLabels:
    """Read the labels of a clip.

    Raises:
        IntegrityError: names shard, clip and member that are damaged.
    """
    content = {name: release.read_member(row, name) for name in _LABELS}
    meta = _meta(content[META], row)
    poses = np.frombuffer(content["poses"], STORED_DTYPES["poses"]).reshape(-1, 7)[: meta.recorded_frames]
    path_m = (meta.T_world_camera0_matrix @ transforms_from_vectors(poses.astype(np.float64)))[:, :3, 3]
    below = np.array([0.0, 0.0, meta.camera_height_m])
    return ClipLabels(
        row=row,
        outline_xy_m=path_outline(path_m[:, :2], PATH_POINTS),
        start_m=path_m[0] - below,
        goal_m=np.array(meta.goal_world_m) - below,
        expert_distance_m=float(np.frombuffer(content["expert_distance"], STORED_DTYPES["expert_distance"])[0]),
        robot_radius_m=meta.robot_radius_m,
        map_digest=meta.map_digest,
    )


def _meta(data: memoryview, row: IndexRow) -> ClipMeta:
    try:
        return parse_meta(data)
    except ValueError as error:
        raise IntegrityError(f"{row.shard}, clip {row.key}: meta.json must be that of a clip, but: {error}") from error
