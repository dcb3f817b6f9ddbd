import numpy as np
import pytest
from matplotlib.colors import to_rgb

from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.view.clip.facts import world_path_m
from wsm_data.view.clip.map_plot import (
    FREE_COLOUR,
    MAP_SWATCHES,
    OCCUPIED_COLOUR,
    PATH_COLOUR,
    SCENE_SWATCHES,
    TIGHT_COLOUR,
    TRAIN_COLOUR,
    contour_levels_m,
    draw_clip_map,
    draw_frame_marks,
    draw_map,
    draw_scene_map,
    map_key,
)
from wsm_data.view.clip.scene_overview import scene_overview, scene_path
from wsm_data.view.drawing.style import figure_style, new_figure


@pytest.fixture
def axes():
    with figure_style():
        yield new_figure(600, 400).add_axes((0.1, 0.1, 0.8, 0.8))


def colours_at(axes, places_m):
    """Colours a drawn map shows at world positions, as 8-bit RGB."""
    figure = axes.figure
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())
    columns, rows = axes.transData.transform(places_m).astype(int).T
    return [tuple(colour) for colour in pixels[pixels.shape[0] - 1 - rows, columns, :3].tolist()]


def eight_bit(colour):
    return tuple(round(part * 255) for part in to_rgb(colour))


def test_the_axes_are_the_worlds_in_metres_at_equal_scale(axes, clip, made):
    draw_clip_map(axes, clip)
    assert axes.get_xlim() == pytest.approx((-0.5, 2.5))  # origin cell -10, 60 columns of 0.05 m
    assert axes.get_ylim() == pytest.approx((1.0, 3.0))
    assert axes.get_aspect() == 1
    assert made.unlabelled_axes(axes.figure) == []


def test_cells_show_what_they_are_where_they_are(axes, clip):
    draw_clip_map(axes, clip)
    corner = [(x_m, 2.75) for x_m in np.linspace(2.05, 2.4, 30)]  # unknown: columns 50-58, rows 30-38
    places = [(-0.48, 1.5), (0.73, 2.38), (-0.3, 2.9), *corner]  # wall in column 0; pillar in columns 20-29, rows 25-29
    wall, pillar, floor, *unknown = colours_at(axes, places)
    assert wall == pillar == eight_bit(OCCUPIED_COLOUR)
    assert floor == eight_bit(FREE_COLOUR)
    assert len(set(unknown)) > 1  # hatched
    assert not set(unknown) & {wall, floor}


def test_free_cells_in_which_the_robot_does_not_fit_are_told_apart(axes, made):
    clip = made.clip()
    geodesic_mm = clip.geodesic_mm.copy()
    geodesic_mm[36:39, 1:10] = 65535
    draw_clip_map(axes, made.clip(geodesic_mm=geodesic_mm))
    assert colours_at(axes, [(-0.3, 2.88)]) == [eight_bit(TIGHT_COLOUR)]


def test_the_path_is_drawn_where_the_camera_was(axes, clip):
    draw_clip_map(axes, clip)
    middle = world_path_m(clip)[:, :2].mean(axis=0)
    assert colours_at(axes, [middle]) == [eight_bit(PATH_COLOUR)]


def test_a_field_that_is_nowhere_reachable_is_drawn_without_contours(axes, clip):
    grid = OccupancyGrid(cells=np.zeros((5, 6), np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    path_xy_m = np.array([[0.1, 0.1], [0.2, 0.1]])
    nowhere = np.full((5, 6), np.nan)
    draw_map(axes, grid, nowhere, path_xy_m, (0.2, 0.1), goal_radius_m=0.05, robot_radius_m=0.05)
    assert colours_at(axes, [(0.02, 0.22)]) == [eight_bit(TIGHT_COLOUR)]


@pytest.mark.parametrize("shape", [(1, 30), (30, 1)])
def test_a_map_of_a_single_row_or_column_is_drawn(axes, shape):
    grid = OccupancyGrid(cells=np.zeros(shape, np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    field_m = np.linspace(0, 3, 30).reshape(shape)
    draw_map(axes, grid, field_m, np.array([[0.02, 0.02]]), (0.02, 0.02), goal_radius_m=0.2, robot_radius_m=0.25)
    axes.figure.canvas.draw()


@pytest.mark.parametrize(
    ("top_m", "expected"),
    [(6.9, [1, 2, 3, 4, 5, 6]), (0.9, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]), (23.0, [5, 10, 15, 20]), (0.05, [])],
)
def test_contours_are_at_round_metres(top_m, expected):
    assert contour_levels_m(np.array([[0.0, top_m, np.nan]])) == pytest.approx(expected)


def test_contour_labels_carry_their_unit(axes, clip):
    draw_clip_map(axes, clip)
    labels = [text.get_text() for text in axes.texts]
    assert "1 m" in labels
    assert all(label.endswith(" m") for label in labels)


def test_marks_are_numbered_and_numbers_never_touch(axes, clip):
    draw_clip_map(axes, clip)
    before = len(axes.texts)
    path_xy_m = world_path_m(clip)[:, :2]
    draw_frame_marks(axes, np.concatenate([path_xy_m, path_xy_m[-1:], path_xy_m[-1:]]), range(11))
    numbers = [text.get_text() for text in axes.texts[before:]]
    assert numbers == [str(number) for number in range(1, 10)]  # the last two stand where the ninth is


def test_numbers_keep_their_distance_on_a_map_that_is_narrower_than_its_axes(axes, made):
    cells = np.zeros((400, 20), np.uint8)
    draw_clip_map(axes, made.clip(occupancy=cells, geodesic_mm=np.zeros((400, 20), np.uint16)))
    before = len(axes.texts)
    steps = np.stack([np.linspace(0, 0.3, 9), np.full(9, 5.0)], axis=1)  # 20 m are 320 px high: 0.3 m are 5 px
    draw_frame_marks(axes, steps, range(9))
    assert [text.get_text() for text in axes.texts[before:]] == ["1"]


def test_a_scene_shows_training_and_held_out_paths_apart(axes, made):
    shifted = made.clip(map_origin_cell=(-10, 60))  # the same map, but not the same poses: the paths coincide
    scene = scene_overview("home", [scene_path(made.clip(), "train"), scene_path(shifted, "test")])
    draw_scene_map(axes, scene)
    colours = [line.get_color() for line in axes.lines if line.get_linestyle() != "None" and len(line.get_xdata()) > 1]
    assert colours == [TRAIN_COLOUR, PATH_COLOUR]
    assert made.unlabelled_axes(axes.figure) == []


def test_the_keys_name_what_maps_show():
    assert [entry.get_label() for entry in map_key()][:4] == [
        "free",
        "free, but the robot does not fit",
        "occupied",
        "unknown",
    ]
    assert [label for label, _ in MAP_SWATCHES][:4] == [
        "free",
        "free, but the robot does not fit",
        "occupied",
        "unknown",
    ]
    assert {"training path", "held-out path"} < {label for label, _ in SCENE_SWATCHES}
