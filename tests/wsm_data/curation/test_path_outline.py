import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.path_outline import Outlines, path_outline


@given(seed=st.integers(0, 1000), count=st.integers(1, 12), points=st.integers(2, 40))
def test_points_lie_on_the_path_in_order_and_evenly_along_it(seed, count, points):
    path = np.random.default_rng(seed).uniform(-5, 5, size=(count, 2)).repeat(2, axis=0)  # with repeated frames
    outline = path_outline(path, points)
    assert outline[0].tolist() == path[0].tolist()
    assert outline[-1].tolist() == path[-1].tolist()
    steps = np.hypot(*np.diff(path, axis=0).T)
    for number, point in enumerate(outline):
        wanted, leg = number / (points - 1) * steps.sum(), 0
        while leg < len(steps) - 1 and wanted > steps[leg]:
            wanted, leg = wanted - steps[leg], leg + 1
        share = wanted / steps[leg] if steps[leg] else 0.0
        assert point == pytest.approx(path[leg] + min(share, 1.0) * (path[leg + 1] - path[leg]), abs=1e-9)


def test_a_path_without_length_is_its_position_again_and_again():
    assert path_outline(np.full((5, 2), 3.0), 4).tolist() == [[3.0, 3.0]] * 4


def test_outlines_of_some_clips_keep_their_floors():
    all_of_them = Outlines(
        xy_m=np.arange(12, dtype=np.float32).reshape(3, 2, 2), floor_z_m=np.array([0, 3, 6], np.float32)
    )
    found = all_of_them.take(np.array([2, 0]))
    assert found.xy_m[:, 0, 0].tolist() == [8, 0]
    assert found.floor_z_m.tolist() == [6, 0]


def test_every_outline_has_a_floor():
    with pytest.raises(ValueError, match="floor_z_m must be"):
        Outlines(xy_m=np.zeros((3, 2, 2), np.float32), floor_z_m=np.zeros(2, np.float32))
