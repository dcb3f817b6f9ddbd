import numpy as np
import pytest

from wsm_data.view.clip.map_figures import clip_map_figure, scene_map_figure
from wsm_data.view.clip.scene_overview import scene_overview, scene_path
from wsm_data.view.drawing.style import figure_style


def test_a_clips_map_fills_its_figure_at_the_maps_proportions(clip, made):
    with figure_style():
        figure = clip_map_figure(clip)
    place = figure.axes[0].get_position().bounds
    width, height = place[2] * figure.get_figwidth(), place[3] * figure.get_figheight()
    assert height / width == pytest.approx(40 / 60, abs=0.01)
    assert made.unlabelled_axes(figure) == []


@pytest.mark.parametrize("shape", [(400, 20), (10, 400)])
def test_extreme_maps_stay_within_a_page(made, shape):
    cells = np.zeros(shape, np.uint8)
    clip = made.clip(occupancy=cells, geodesic_mm=np.zeros(shape, np.uint16))
    with figure_style():
        figure = clip_map_figure(clip)
    assert 100 < figure.get_figheight() * 100 < 600


def test_a_scenes_map_has_its_axes_labelled(clip, made):
    with figure_style():
        figure = scene_map_figure(scene_overview("home", [scene_path(clip, "train")]))
    assert made.unlabelled_axes(figure) == []
