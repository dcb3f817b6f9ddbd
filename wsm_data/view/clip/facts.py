"""The numbers of one clip that its report speaks of, and the places of its path in the world."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from wsm_data.geometry.transform import transform_points
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.clip import UNREACHABLE_MM, Clip
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid
from wsm_data.shards.statistics import real_latents

# A square's nearest point is nearer than its centre by between 1/2 and 1/sqrt(2) of its side, so the nearest square is
# among the few nearest centres.
_NEAREST_CENTRES = 12


@dataclass(frozen=True, kw_only=True)
class ClipFacts:
    """What is counted of a clip. Padded still frames are left out of everything but `padded_frames`.

    Attributes:
        key: key of the clip.
        frames: raw frames, padding not counted.
        padded_frames: still frames at the end.
        path_length_m: length of the expert's path over the floor, m.
        start_distance_m: geodesic distance from the start to the goal region, m.
        detour: geodesic over straight distance from the start to the goal point, a ratio; None where the start lies in
            the goal region. The geodesic to the point is taken as the one to the region plus the region's radius.
        clearance_median_m: median over the path of the distance to the nearest occupied cell, m; None where no cell of
            the crop is occupied.
        clearance_min_m: smallest such distance, m; None likewise.
        camera_height_m: height of the camera above the floor, m.
        camera_pitch_deg: pitch down from the horizontal, degrees.
        depth_valid_share: share of depth pixels with a measurement; None where the clip has no depth.
        map_area_m2: area of the map crop, m^2.
        map_unknown_share: share of the crop's cells that are unknown.
        notes: reason codes of what was accepted but is worth knowing.
    """

    key: str
    frames: int
    padded_frames: int
    path_length_m: float
    start_distance_m: float
    detour: float | None
    clearance_median_m: float | None
    clearance_min_m: float | None
    camera_height_m: float
    camera_pitch_deg: float
    depth_valid_share: float | None
    map_area_m2: float
    map_unknown_share: float
    notes: tuple[str, ...]


def clip_facts(clip: Clip) -> ClipFacts:
    """Measure one clip."""
    meta, path_xy_m = clip.meta, world_path_m(clip)[:, :2]
    clearance_m = path_clearance_m(clip.grid, path_xy_m)
    return ClipFacts(
        key=meta.key,
        frames=clip.meta.recorded_frames,
        padded_frames=meta.padded_frames,
        path_length_m=float(np.linalg.norm(np.diff(path_xy_m, axis=0), axis=1).sum()),
        start_distance_m=float(clip.expert_distance[0]),
        detour=_detour(clip, path_xy_m[0]),
        clearance_median_m=None if clearance_m is None else float(np.median(clearance_m)),
        clearance_min_m=None if clearance_m is None else float(clearance_m.min()),
        camera_height_m=meta.camera_height_m,
        camera_pitch_deg=float(np.rad2deg(meta.camera_pitch_rad)),
        depth_valid_share=depth_valid_share(clip),
        map_area_m2=clip.occupancy.size * meta.map_resolution_m**2,
        map_unknown_share=float((clip.occupancy == UNKNOWN).mean()),
        notes=meta.notes,
    )


def world_path_m(clip: Clip) -> Float64Array:
    """Camera positions in the world, m, padding left out; float64 [T - padded, 3]."""
    positions = clip.poses[: clip.meta.recorded_frames, :3].astype(np.float64)
    return transform_points(clip.meta.T_world_camera0_matrix, positions)


def clip_field_m(clip: Clip) -> Float64Array:
    """Geodesic distance to the goal region, m, float64 [Y, X]; NaN where it is occupied or cannot be reached from."""
    return np.where(clip.geodesic_mm == UNREACHABLE_MM, np.nan, clip.geodesic_mm / 1000.0)


def depth_valid_share(clip: Clip) -> float | None:
    """Share of depth pixels with a measurement, over the latents that hold more than padding; None without depth."""
    if clip.depth_valid is None:
        return None
    latents = real_latents(clip.frame_count, clip.meta.padded_frames)
    return float(clip.depth_valid[:latents].mean() / 255)


def path_clearance_m(grid: OccupancyGrid, path_xy_m: Float64Array) -> Float64Array | None:
    """Distance of each position [T, 2] to the nearest occupied cell's square, m [T]; None where no cell is occupied."""
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    if not len(rows):
        return None
    centres = np.stack([columns, rows], axis=1).astype(np.float64)
    points = grid.fractional_cells(path_xy_m)
    _, nearest = cKDTree(centres).query(points, k=min(_NEAREST_CENTRES, len(centres)))
    offset = np.abs(points[:, None, :] - centres[nearest.reshape(len(points), -1)])
    return np.linalg.norm(np.maximum(offset - 0.5, 0.0), axis=2).min(axis=1) * grid.resolution_m


def _detour(clip: Clip, start_xy_m: Float64Array) -> float | None:
    straight_m = float(np.linalg.norm(start_xy_m - np.array(clip.meta.goal_world_m[:2])))
    if straight_m <= clip.meta.goal_radius_m:
        return None
    return (float(clip.expert_distance[0]) + clip.meta.goal_radius_m) / straight_m
