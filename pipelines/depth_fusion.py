"""World points from the depth frames of a scene that came without a point cloud."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wsm_data.codecs.images import decode_depth
from wsm_data.errors import DataError
from wsm_data.geometry.camera import unproject
from wsm_data.geometry.transform import transform_points
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.depth import DepthEncoding, DepthRange
from wsm_data.schema.episode import EpisodeRecord


def fused_points(
    records: Sequence[EpisodeRecord],
    depth_samples: Mapping[str, tuple[tuple[int, bytes], ...]],
    encoding: DepthEncoding,
    depth_range: DepthRange | None = None,
) -> Iterator[Float64Array]:
    """Points of the sampled depth frames in world coordinates, one float64 [N, 3] array (m) a frame.

    Measurements outside the depth range are left out: beyond it the source's depth is not trained on either. A frame
    that does not decode adds nothing; its trajectory is refused when it is encoded.

    Args:
        records: trajectories of the scene.
        depth_samples: (frame number, PNG bytes) by trajectory.
        encoding: how the source stores depth.
        depth_range: depths to use; the paper's range where None.
    """
    limits = depth_range or DepthRange()
    for record in records:
        for frame, data in depth_samples.get(record.id.text, ()):
            try:
                raw = decode_depth(data, f"{record.id.text}, frame {frame}")
            except DataError:
                continue
            depth_m = raw.astype(np.float64) * encoding.metres_per_unit
            measured = ~np.isin(raw, encoding.invalid_codes) & (depth_m >= limits.min_m) & (depth_m <= limits.max_m)
            points_camera = unproject(depth_m, record.intrinsics)[measured]
            yield transform_points(record.T_world_camera[frame], points_camera)
