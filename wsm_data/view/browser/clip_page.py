"""What the page of one clip shows beside its pictures: numbers, the map, and the path on it."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np

from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.occupancy import FREE, OccupancyGrid
from wsm_data.view.clip.facts import ClipFacts, clip_facts, clip_field_m, world_path_m
from wsm_data.view.clip.map_plot import cell_picture

_LINE_EVERY_M = 1.0
_LINE_COLOUR = (127, 169, 209, 255)


def clip_page(clip: Clip) -> dict[str, Any]:
    """One clip as JSON values: facts with units, and path, goal and footprint in cells of the map's picture.

    Places are (right, down) from the picture's upper left corner, in cells; `map_picture` is that picture.
    """
    meta, path_m = clip.meta, world_path_m(clip)[:, :2]
    rows, columns = clip.occupancy.shape
    return {
        "key": meta.key,
        "unit": meta.id.text,
        "frames": meta.recorded_frames,
        "width": meta.intrinsics.width,
        "height": meta.intrinsics.height,
        "has_depth": clip.has_depth,
        "depth_m": [meta.depth_range.min_m, meta.depth_range.max_m],
        "facts": list(_facts(clip_facts(clip)).items()),
        "distance_m": [round(float(one), 3) for one in clip.expert_distance[: meta.recorded_frames]],
        "map": {
            "columns": columns,
            "rows": rows,
            "cell_m": meta.map_resolution_m,
            "line_every_m": _LINE_EVERY_M,
            "path": in_picture(clip.grid, path_m).round(2).tolist(),
            "goal": in_picture(clip.grid, np.array([meta.goal_world_m[:2]]))[0].round(2).tolist(),
            "goal_radius": meta.goal_radius_m / meta.map_resolution_m,
            "robot_radius": meta.robot_radius_m / meta.map_resolution_m,
        },
    }


def in_picture(grid: OccupancyGrid, xy_m: Float64Array) -> Float64Array:
    """World positions [N, 2] (m) as (right, down) from the upper left corner of a map with north up, in cells."""
    places = grid.fractional_cells(xy_m) + 0.5
    return np.stack([places[:, 0], grid.cells.shape[0] - places[:, 1]], axis=1)


def map_picture(clip: Clip) -> bytes:
    """PNG of the clip's map, a pixel a cell, north up, transparent where unknown, a line every metre to the goal."""
    field_m = clip_field_m(clip)
    picture = cell_picture(clip.grid, field_m)
    picture[_lines(field_m) & (clip.occupancy == FREE)] = _LINE_COLOUR
    return png(np.ascontiguousarray(picture[::-1]))


def png(picture_u8: Uint8Array) -> bytes:
    """PNG of a picture with transparency, uint8 RGBA [H, W, 4]."""
    done, data = cv2.imencode(".png", cv2.cvtColor(picture_u8, cv2.COLOR_RGBA2BGRA))
    if not done:
        raise OSError("OpenCV cannot write a map as PNG")
    return data.tobytes()


def _lines(field_m: Float64Array) -> np.ndarray:
    """Cells next to one that lies a whole metre further from the goal; bool [Y, X]."""
    band = np.floor(np.nan_to_num(field_m, nan=-1.0) / _LINE_EVERY_M)
    known = np.isfinite(field_m)
    lines = np.zeros(field_m.shape, np.bool_)
    lines[:, 1:] |= (band[:, 1:] != band[:, :-1]) & known[:, 1:] & known[:, :-1]
    lines[1:] |= (band[1:] != band[:-1]) & known[1:] & known[:-1]
    return lines


def _facts(facts: ClipFacts) -> Mapping[str, str]:
    found = {
        "frames": f"{facts.frames}, then {facts.padded_frames} still",
        "path length": f"{facts.path_length_m:.2f} m",
        "geodesic distance at the start": f"{facts.start_distance_m:.2f} m",
        "detour (geodesic / straight)": _said(facts.detour, "", "the start lies in the goal region"),
        "clearance, median": _said(facts.clearance_median_m, " m", "nothing is occupied"),
        "clearance, least": _said(facts.clearance_min_m, " m", "nothing is occupied"),
        "camera": f"{facts.camera_height_m:.2f} m high, {facts.camera_pitch_deg:.1f}° down",
        "depth measured": "no depth" if facts.depth_valid_share is None else f"{facts.depth_valid_share:.1%}",
        "map": f"{facts.map_area_m2:.1f} m², {facts.map_unknown_share:.0%} unknown",
    }
    return found | ({"notes": ", ".join(facts.notes)} if facts.notes else {})


def _said(value: float | None, unit: str, otherwise: str) -> str:
    return otherwise if value is None else f"{value:.2f}{unit}"
