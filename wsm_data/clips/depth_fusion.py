"""World points from the depth frames of a scene that came without a point cloud."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes
from wsm_data.errors import DataError
from wsm_data.geometry.camera import unproject
from wsm_data.geometry.transform import transform_points
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.depth import DepthEncoding, DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import DepthFrame


def fused_points(
    records: Sequence[EpisodeRecord],
    depth_samples: Mapping[str, Sequence[tuple[int, DepthFrame]]],
    encoding: DepthEncoding,
) -> Iterator[Float64Array]:
    """Points of the sampled depth frames in world coordinates, one float64 [N, 3] array (m) a frame.

    Measurements outside the paper's depth range are left out: beyond it depth is not trained on either. A frame
    that does not decode adds nothing; its trajectory is refused when it is encoded.

    Args:
        records: trajectories of the scene.
        depth_samples: (frame number, depth image) by trajectory.
        encoding: how the source stores depth.
    """
    limits = DepthRange()
    for record in records:
        for frame, image in depth_samples.get(record.id.text, ()):
            try:
                raw = depth_codes(image, f"{record.id.text}, frame {frame}")
            except DataError:
                continue
            depth_m = depth_m_from_raw(raw, encoding)
            low_m, high_m = np.float32(limits.min_m), np.float32(limits.max_m)  # as depth is rounded, so its limits are
            in_range = (depth_m >= low_m) & (depth_m <= high_m)  # 0, without measurement, is not
            points_camera = unproject(depth_m.astype(np.float64), record.intrinsics)[in_range]
            yield transform_points(record.T_world_camera[frame], points_camera)
