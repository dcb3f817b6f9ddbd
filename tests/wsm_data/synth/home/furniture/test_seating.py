import numpy as np
import pytest

from wsm_data.synth.home.furniture import seating


def test_seats_stand_on_their_footprints(style, stands_on_its_footprint):
    rng = np.random.default_rng(0)
    for item in (
        seating.sofa(rng, style, 2.0, style.cloth[0]),
        seating.armchair(style, style.cloth[1]),
        seating.chair(style.wood, style.cloth[0]),
        seating.office_chair(style, style.cloth[0]),
        seating.stool(style.wood),
    ):
        stands_on_its_footprint(item)


def test_the_back_of_a_chair_is_behind_its_seat(style):
    points = seating.chair(style.wood, style.cloth[0]).surface.points_m.reshape(-1, 3)
    assert points[points[:, 2] > 0.6, 1].mean() < 0.1
    assert points[(points[:, 2] > 0.4) & (points[:, 2] < 0.5), 1].mean() > 0.15


@pytest.mark.parametrize("width", [1.6, 2.3])
def test_a_sofa_is_as_wide_as_asked_for(style, width):
    sofa = seating.sofa(np.random.default_rng(0), style, width, style.cloth[0])
    x = sofa.surface.points_m[..., 0]
    assert x.max() - x.min() == pytest.approx(width, abs=0.02)
