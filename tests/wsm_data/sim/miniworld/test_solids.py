from types import SimpleNamespace

import numpy as np
import pytest

from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN
from wsm_data.sim.miniworld.solids import obstacle_outlines, occupancy

BOX = ((3.0, 0.0, 1.0), np.pi / 4, (0.8, 0.8, 0.8))


def scene(*boxes):
    """What is asked of a scene of MiniWorld: a room of 4 m x 2 m and 2.5 m, and boxes."""
    outline = np.array([[4, 0, 2], [4, 0, 0], [0, 0, 0], [0, 0, 2]], float)
    up = np.array([0, 2.5, 0])
    walls = [[a, a + up, b + up, b] for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True)]
    agent = SimpleNamespace()
    found = [SimpleNamespace(pos=np.array(pos, float), dir=turn, size=np.array(size)) for pos, turn, size in boxes]
    room = SimpleNamespace(outline=outline, wall_verts=np.reshape(walls, (-1, 3)))
    return SimpleNamespace(rooms=[room], agent=agent, entities=[*found, agent])


def outlines_of(given):
    return obstacle_outlines(given, 0.15, 0.3)


def test_miniworlds_z_is_our_minus_y_and_walls_stand_where_rooms_end():
    points = np.array([[2.0, -0.25], [0.5, -1.0], [3.9, -1.0], [2.0, 0.5]])
    assert outlines_of(scene()).clearance_m(points, 10.0) == pytest.approx([0.25, 0.5, 0.1, 0.5])


def test_a_box_is_turned_with_its_direction_and_full():
    corner_m = 0.8 / np.sqrt(2)  # half of the diagonal, along x where the box is turned by 45 degrees
    points = np.array([[3.0 - corner_m - 0.2, -1.0], [3.0, -1.0]])
    assert outlines_of(scene(BOX)).clearance_m(points, 10.0) == pytest.approx([0.2, 0.0])


def test_a_box_that_is_lower_than_the_ground_clearance_is_no_obstacle():
    low = (BOX[0], 0.0, (0.8, 0.1, 0.8))
    assert outlines_of(scene(low)).clearance_m(np.array([[3.0, -1.0]]), 10.0) == pytest.approx([1.0])  # the wall


def test_the_map_agrees_with_a_reference_cell_by_cell():
    given = scene(BOX)
    grid = occupancy(given, outlines_of(given))
    rows, columns = np.indices(grid.cells.shape)
    centres = grid.cell_centres_xy_m(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
    found = {FREE: 0, OCCUPIED: 0, UNKNOWN: 0}
    for (x, y), cell in zip(centres, grid.cells.ravel().tolist(), strict=True):
        from_box = max(abs(x - 3 + y + 1), abs(y + 1 - x + 3)) / np.sqrt(2) - 0.4  # in the axes of the box
        into_room = min(x, 4 - x, -y, y + 2)
        if from_box < 0 or abs(into_room) < 0.025:
            assert cell == OCCUPIED
        elif into_room > 0.06 and from_box > 0.06:
            assert cell == FREE
        elif into_room < -0.06:
            assert cell == UNKNOWN
        found[cell] += 1
    assert min(found.values()) > 50


def test_a_scene_with_anything_but_boxes_is_refused():
    given = scene()
    given.entities.append(SimpleNamespace(pos=np.zeros(3)))
    with pytest.raises(ValueError, match="only walls, floors and boxes are known"):
        outlines_of(given)
