"""A film of one episode or clip: what is seen, a second picture beside it, and the way on the map below."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex

import cv2
import numpy as np

from wsm_data.files.atomic import TEMPORARY_SUFFIX
from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid

_PICTURE_PX = (480, 270)
_MAP_HEIGHT_PX = 450
_FRAMES_PER_S = 20 / 3  # one a control step of 0.15 s: the film runs as fast as the robot
_BACKGROUND, _UNKNOWN, _WALL = 255, 228, 70
_TRUE, _ESTIMATED, _GOAL = (201, 40, 62), (31, 102, 177), (0, 121, 107)
_INK = (31, 42, 51)
_SHIFT = 4  # bits of a fraction of a pixel


@dataclass(frozen=True, kw_only=True)
class FilmFrame:
    """One control step, or one frame of a clip.

    Attributes:
        seen_u8: what the camera shows; uint8 [H, W, 3].
        beside_u8: what stands beside it, any size: what the planner expects to see, or depth in colours; None where
            there is none.
        true_m: where the robot has been until now, world; float64 [N, 2], m.
        estimated_m: where it believed to be; float64 [M, 2], M may be 0.
        caption: lines of text.
    """

    seen_u8: Uint8Array
    beside_u8: Uint8Array | None
    true_m: Float64Array
    estimated_m: Float64Array
    caption: tuple[str, ...]


def write_film(path: Path, grid: OccupancyGrid, goal_m: Float64Array, frames: Iterator[FilmFrame]) -> int:
    """Write an MP4 (MPEG-4 part 2); replaced as a whole.

    Args:
        path: ends in .mp4.
        grid: the map.
        goal_m: the goal in the world; float64 [2], m.
        frames: in the order of time.

    Returns:
        How many frames were written.

    Raises:
        OSError: this OpenCV cannot write such a film there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{token_hex(8)}{TEMPORARY_SUFFIX}.mp4")
    temporary.touch()  # says what keeps a file from being there; OpenCV says nothing
    size = (2 * _PICTURE_PX[0], _PICTURE_PX[1] + _MAP_HEIGHT_PX)
    writer = cv2.VideoWriter(str(temporary), cv2.VideoWriter.fourcc(*"mp4v"), _FRAMES_PER_S, size)
    if not writer.isOpened():
        raise OSError(f"OpenCV must be able to write an MP4 at {path}, and is not; is its build without video?")
    count = 0
    try:
        background = _map_picture(grid)
        for frame in frames:
            writer.write(cv2.cvtColor(film_picture(background, grid, goal_m, frame), cv2.COLOR_RGB2BGR))
            count += 1
        writer.release()
        temporary.replace(path)
    finally:
        writer.release()
        temporary.unlink(missing_ok=True)
    return count


def film_picture(background: Uint8Array, grid: OccupancyGrid, goal_m: Float64Array, frame: FilmFrame) -> Uint8Array:
    """One picture of a film, uint8 [720, 960, 3]: what is seen, what stands beside it, the map below."""
    seen = _fitted(frame.seen_u8)
    beside = np.full_like(seen, _UNKNOWN) if frame.beside_u8 is None else _fitted(frame.beside_u8)
    map_u8 = background.copy()
    for points, colour in ((frame.true_m, _TRUE), (frame.estimated_m, _ESTIMATED)):
        if len(points):
            pixels = np.round(_pixels(grid, points) * (1 << _SHIFT)).astype(np.int32)
            cv2.polylines(map_u8, [pixels], False, colour, 2, cv2.LINE_AA, _SHIFT)
            cv2.circle(map_u8, tuple(pixels[-1].tolist()), 5 << _SHIFT, colour, -1, cv2.LINE_AA, _SHIFT)
    cv2.circle(map_u8, tuple(np.round(_pixels(grid, goal_m[None])[0]).astype(int).tolist()), 7, _GOAL, 3, cv2.LINE_AA)
    for line, text in enumerate(frame.caption):
        cv2.putText(map_u8, text, (10, 20 * (line + 1)), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _INK, 1, cv2.LINE_AA)
    return np.concatenate([np.concatenate([seen, beside], axis=1), map_u8])


def _fitted(picture_u8: Uint8Array) -> Uint8Array:
    """A picture as large as its place allows, in the middle of it; its sides keep their ratio."""
    height, width = picture_u8.shape[:2]
    scale = min(_PICTURE_PX[0] / width, _PICTURE_PX[1] / height)
    size = round(scale * width), round(scale * height)
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    left, top = (_PICTURE_PX[0] - size[0]) // 2, (_PICTURE_PX[1] - size[1]) // 2
    place = np.full((_PICTURE_PX[1], _PICTURE_PX[0], 3), _UNKNOWN, np.uint8)
    place[top : top + size[1], left : left + size[0]] = cv2.resize(picture_u8, size, interpolation=method)
    return place


def _scale(grid: OccupancyGrid) -> tuple[float, Float64Array]:
    """Pixels a cell, and where the map's lower left corner lies in its picture."""
    rows, columns = grid.cells.shape
    width = 2 * _PICTURE_PX[0]
    scale = min(width / columns, _MAP_HEIGHT_PX / rows)
    return scale, np.array([(width - scale * columns) / 2, (_MAP_HEIGHT_PX + scale * rows) / 2])


def _pixels(grid: OccupancyGrid, points_m: Float64Array) -> Float64Array:
    scale, corner = _scale(grid)
    cells = (points_m - np.array(grid.origin_xy_m)) / grid.resolution_m
    return corner + scale * cells * np.array([1.0, -1.0])


def _map_picture(grid: OccupancyGrid) -> Uint8Array:
    scale, corner = _scale(grid)
    grey = np.full(grid.cells.shape, _UNKNOWN, np.uint8)
    grey[grid.cells == FREE], grey[grid.cells == OCCUPIED] = _BACKGROUND, _WALL
    to_picture = np.array([[scale, 0.0, corner[0]], [0.0, -scale, corner[1]]])
    picture = cv2.warpAffine(
        grey, to_picture, (2 * _PICTURE_PX[0], _MAP_HEIGHT_PX), flags=cv2.INTER_NEAREST, borderValue=(_UNKNOWN,)
    )
    return np.repeat(picture[..., None], 3, axis=2)
