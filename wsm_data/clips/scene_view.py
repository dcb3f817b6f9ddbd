"""A trajectory on the map of its scene: what is kept of the map, and how far it is to the goal."""

from dataclasses import dataclass

from wsm_data.checks.gate import require_kept
from wsm_data.checks.goal_reached import check_goal_reached
from wsm_data.checks.reachability import check_goal_reachable
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.path_on_floor import PathOnFloor, with_goal_xy_m
from wsm_data.maps.crop import crop_around
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import sample_distance
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.schema.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class SceneView:
    """A trajectory on the map of its scene.

    Attributes:
        occupancy: crop of the map around path and goal.
        geodesic_m: geodesic distance to the goal region on the crop, m; float32 [Y, X].
        distance_m: geodesic distance of every camera position, m; float64 [T].
        freed_cells: unknown cells that became free: those the expert's footprint swept, and the holes filled before.
    """

    occupancy: OccupancyGrid
    geodesic_m: Float32Array
    distance_m: Float64Array
    freed_cells: int


def view_scene(record: EpisodeRecord, laid: PathOnFloor, dataset: DatasetManifest, config: ClipConfig) -> SceneView:
    """Measure distances to the goal and cut the map around the path.

    Distances are measured on the whole floor and cropped afterwards: a detour may lead through rooms that the crop
    leaves out.

    Raises:
        DataError: a verdict on the path is against it, the goal cannot be reached, or the expert ends elsewhere than at
            the stated one.
    """
    require_kept(*laid.verdicts.values())
    floor = laid.floor
    geodesic_m, distance_m = goal_distances(record, laid, dataset, config)
    require_kept(*goal_verdicts(record, distance_m, config).values())
    crop = crop_around(floor, with_goal_xy_m(record), config.map_margin_m)
    column, row = (inner - outer for inner, outer in zip(crop.origin_cell, floor.origin_cell, strict=True))
    height, width = crop.cells.shape
    return SceneView(
        occupancy=crop,
        geodesic_m=geodesic_m[row : row + height, column : column + width],
        distance_m=distance_m,
        freed_cells=laid.freed_cells,
    )


def goal_distances(
    record: EpisodeRecord, laid: PathOnFloor, dataset: DatasetManifest, config: ClipConfig
) -> tuple[Float32Array, Float64Array]:
    """Geodesic distance to the goal region of every cell of the floor, and of every camera position [T], m."""
    field_m = geodesic_distance(laid.floor, record.goal_m[:2], dataset.robot.radius_m, config.goal_radius_m)
    return field_m, sample_distance(field_m, laid.floor, record.path_xy_m)


def goal_verdicts(record: EpisodeRecord, distance_m: Float64Array, config: ClipConfig) -> dict[str, Verdict]:
    """Whether a way leads to the goal, and whether the expert took it to its end; distances [T] are to the goal, m."""
    reachable = check_goal_reachable(distance_m, record.id.text)
    if not reachable.keep:
        return {"reachability": reachable}
    reached = check_goal_reached(float(distance_m[-1]), config.goal_radius_m, record.id.text)
    return {"reachability": reachable, "goal_reached": reached}
