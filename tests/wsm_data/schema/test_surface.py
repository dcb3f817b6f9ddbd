"""The surface of a scene is one sorted set of boxes: equal surfaces have equal bytes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.schema.surface import SurfaceVoxels

CORNERS = st.sampled_from([-32768, -1, 0, 1, 32767])  # where packing three int16 into one number could go wrong
CELLS = st.tuples(CORNERS, CORNERS, CORNERS)


def surface(cells, obstacle=None, origin="cloud"):
    cells = np.array(cells, np.int16).reshape(-1, 3)
    return SurfaceVoxels(
        cells=cells, obstacle=np.zeros(len(cells), bool) if obstacle is None else obstacle, origin=origin
    )


@given(st.sets(CELLS, max_size=12))
def test_cells_in_lexicographic_order_are_accepted(cells):
    assert surface(sorted(cells)).cells.tolist() == [list(cell) for cell in sorted(cells)]


@given(st.lists(CELLS, min_size=2, max_size=6).filter(lambda cells: cells != sorted(set(cells))))
def test_any_other_order_and_any_repetition_is_refused(cells):
    with pytest.raises(ValueError, match="cells must be sorted and unique"):
        surface(cells)


def test_the_first_pair_in_the_wrong_order_is_named():
    with pytest.raises(ValueError, match=r"found \[1, 2, 3\] before \[1, 2, -3\]$"):
        surface([(0, 0, 0), (1, 2, 3), (1, 2, -3)])


def test_a_scene_without_surface_is_a_value():
    assert len(surface([]).cells) == 0


def test_the_marks_must_be_as_many_as_the_boxes():
    with pytest.raises(ValueError, match=r"^obstacle must be bool \[1\], found bool \[2\]"):
        surface([(0, 0, 0)], obstacle=np.zeros(2, bool))


def test_an_unknown_origin_is_refused():
    with pytest.raises(ValueError, match=r"^origin must be 'cloud', 'depth' or 'path', found 'mesh'"):
        surface([(0, 0, 0)], origin="mesh")


def test_the_arrays_cannot_be_written_to():
    voxels = surface([(0, 0, 0)])
    assert not voxels.cells.flags.writeable
    assert not voxels.obstacle.flags.writeable
