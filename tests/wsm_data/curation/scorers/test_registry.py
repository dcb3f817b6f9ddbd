"""What holds for every geometry score: it belongs to the scene, not to where the scene lies or how it was filmed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from wsm_data.curation.scorers.registry import GEOMETRY_SCORERS, IMAGE_SCORERS

ROUNDING = 1e-9  # positions in m and cells are added to other numbers after a shift: relative errors of 1e-16 each

every_score = pytest.mark.parametrize("scorer", GEOMETRY_SCORERS, ids=lambda scorer: scorer.info.name)


@every_score
def test_it_is_a_number_of_the_home(scorer, home):
    value = scorer.score(home)
    assert math.isfinite(value)
    assert value >= 0


@every_score
def test_a_shift_of_the_scene_by_whole_cells_changes_nothing(scorer, home, moved):
    for cells in ((1, 0), (-130, 77), (4000, -3)):
        assert scorer.score(moved(home, cells=cells)) == pytest.approx(scorer.score(home), abs=ROUNDING)


@every_score
def test_quarter_turns_of_the_scene_change_nothing(scorer, home, moved):
    for quarters in (1, 2, 3):
        assert scorer.score(moved(home, quarters=quarters)) == pytest.approx(scorer.score(home), abs=ROUNDING)


@every_score
def test_frames_that_stand_still_change_nothing_but_means_over_frames(scorer, home):
    if scorer.info.unit.endswith("per frame"):
        pytest.skip("it is a mean over frames")
    still = replace(home, T_world_camera=np.concatenate([home.T_world_camera, home.T_world_camera[-1:].repeat(9, 0)]))
    assert scorer.score(still) == pytest.approx(scorer.score(home), abs=ROUNDING)


@pytest.mark.parametrize(
    "name", ["path_length_m", "detour_ratio", "turning_total_rad", "turning_sharpest_rad", "goal_out_of_view_share"]
)
@pytest.mark.parametrize("angle_rad", [0.3, 1.234, -2.5])
def test_scores_that_do_not_touch_the_map_are_the_same_under_any_turn(name, angle_rad, drive, floor):
    scorer = next(one for one in GEOMETRY_SCORERS if one.info.name == name)
    grid, c, s = floor(8.0, 8.0), np.cos(angle_rad), np.sin(angle_rad)
    way = np.array([(3.0, 3.1), (4.2, 3.3), (4.4, 5.0)])
    turned = (way - 4.0) @ np.array([[c, s], [-s, c]]) + 4.0
    one, other = drive(grid, way, step_m=0.05), drive(grid, turned, step_m=0.05)
    assert scorer.score(other) == pytest.approx(scorer.score(one), abs=ROUNDING)


def test_every_score_has_a_name_of_its_own_and_says_what_it_is():
    infos = [one.info for one in (*GEOMETRY_SCORERS, *IMAGE_SCORERS)]
    assert len({info.name for info in infos}) == len(infos)
    assert all(info.unit and info.summary and info.version >= 1 for info in infos)
