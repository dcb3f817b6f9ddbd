"""The surface of a scene: from its cloud, from the depth of its trajectories where it has none, or unknown."""

from collections.abc import Sequence

from wsm_data.clips.depth_fusion import fused_points
from wsm_data.clips.depth_gate import agreeing_records
from wsm_data.maps.voxels import no_voxels, voxels_from_cloud, voxels_from_depth
from wsm_data.readers.source import ContainerScan
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.surface import SurfaceVoxels


def scene_surface(scan: ContainerScan, records: Sequence[EpisodeRecord], dataset: DatasetManifest) -> SurfaceVoxels:
    """The voxels of a scene whose cloud, if it has one, is whole.

    Args:
        scan: what was found of the scene.
        records: its trajectories that passed the checks.
        dataset: conventions of the source.

    Raises:
        DataError: a `cloud.*` reason, or points too far away for the grid of a map.
    """
    if scan.cloud is not None:
        return voxels_from_cloud(scan.cloud, dataset.cloud)
    if not any(record.has_depth for record in records):
        return no_voxels()
    agreeing = agreeing_records(records, scan.depth_samples, dataset)
    return voxels_from_depth(fused_points(agreeing, scan.depth_samples, dataset.depth))
