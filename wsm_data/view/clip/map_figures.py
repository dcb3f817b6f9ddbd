"""Maps as figures of their own, as tall as the map needs."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wsm_data.schema.clip import Clip
from wsm_data.view.clip.map_plot import draw_clip_map, draw_scene_map
from wsm_data.view.clip.scene_overview import SceneOverview
from wsm_data.view.drawing.style import new_figure

_WIDTH_PX = 400
_LEFT_PX, _RIGHT_PX, _TOP_PX, _BOTTOM_PX = 66, 14, 12, 50
_TALLEST_PX = 440
_FLATTEST_PX = 90


def clip_map_figure(clip: Clip) -> Figure:
    """The map of one clip; call within `figure_style()`."""
    figure, axes = _map_figure(clip.occupancy.shape)
    draw_clip_map(axes, clip)
    return figure


def scene_map_figure(scene: SceneOverview) -> Figure:
    """The map of a scene with all its paths; call within `figure_style()`."""
    figure, axes = _map_figure(scene.grid.cells.shape)
    draw_scene_map(axes, scene)
    return figure


def _map_figure(shape: tuple[int, ...]) -> tuple[Figure, Axes]:
    rows, columns = shape
    width_px = _WIDTH_PX - _LEFT_PX - _RIGHT_PX
    height_px = min(max(round(width_px * rows / columns), _FLATTEST_PX), _TALLEST_PX)
    total_px = height_px + _TOP_PX + _BOTTOM_PX
    figure = new_figure(_WIDTH_PX, total_px)
    place = (_LEFT_PX / _WIDTH_PX, _BOTTOM_PX / total_px, width_px / _WIDTH_PX, height_px / total_px)
    return figure, figure.add_axes(place)
