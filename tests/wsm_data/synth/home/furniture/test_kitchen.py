import numpy as np
import pytest

from wsm_data.synth.home.furniture import kitchen


def test_kitchens_stand_on_their_footprints(style, stands_on_its_footprint):
    rng = np.random.default_rng(0)
    for item in (
        kitchen.kitchen_run(rng, style, 3.0, True),
        kitchen.kitchen_run(rng, style, 1.8, False),
        kitchen.island(rng, style),
        kitchen.waste_bin(),
    ):
        stands_on_its_footprint(item)


@pytest.mark.parametrize(("high", "top"), [(True, 2.17), (False, 1.2)])
def test_only_a_high_run_has_units_above_the_worktop(style, high, top):
    run = kitchen.kitchen_run(np.random.default_rng(1), style, 2.9, high)
    assert run.surface.points_m[..., 2].max() == pytest.approx(top, abs=0.03)
    assert run.height_m == (2.1 if high else 1.05)
