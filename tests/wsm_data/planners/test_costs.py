"""Ways against Dijkstra's algorithm of scipy, and prices against distances."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csgraph

from wsm_data.planners.costs import Caution, cheapest_way, prices, shortened
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid

RADIUS_M = 0.25
CAUTION = Caution(margin_m=0.08, comfort_m=0.25)


def length_of(price, way):
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    return float((steps * price[way[1:, 0], way[1:, 1]]).sum())


def by_scipy(price, start, goal):
    rows, columns = price.shape
    graph = sparse.lil_array((price.size, price.size))
    for row in range(rows):
        for column in range(columns):
            for down, right in ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1)):
                i, j = row + down, column + right
                if 0 <= i < rows and 0 <= j < columns and np.isfinite(price[i, j]):
                    graph[row * columns + column, i * columns + j] = np.hypot(down, right) * price[i, j]
    cost = csgraph.dijkstra(graph.tocsr(), indices=start[0] * columns + start[1])
    return float(cost[goal[0] * columns + goal[1]])


@pytest.mark.parametrize("seed", range(4))
def test_the_way_is_as_cheap_as_the_one_of_an_exhaustive_search(seed):
    rng = np.random.default_rng(seed)
    price = 1 + rng.exponential(size=(14, 17))
    price[rng.random(price.shape) < 0.25] = np.inf
    price[0, 0] = price[-1, -1] = 1.0
    wanted = by_scipy(price, (0, 0), (13, 16))
    way = cheapest_way(price, (0, 0), (13, 16))
    assert len(way) == 0 if np.isinf(wanted) else length_of(price, way) == pytest.approx(wanted)


def test_where_nothing_leads_to_the_goal_the_way_is_empty():
    price = np.ones((5, 5))
    price[:, 2] = np.inf
    assert cheapest_way(price, (0, 0), (0, 4)).shape == (0, 2)


def test_a_zigzag_becomes_the_straight_piece_it_stands_for():
    price = np.ones((10, 30))
    way = cheapest_way(price, (0, 0), (4, 29))
    assert shortened(price, way).tolist() == [[0, 0], [4, 29]]


def test_a_corner_that_costs_stays_a_corner():
    price = np.ones((20, 20))
    price[5:, 5:] = np.inf
    way = shortened(price, cheapest_way(price, (19, 0), (0, 19)))
    assert len(way) > 2
    assert all(np.isfinite(price[row, column]) for row, column in way)


def test_a_metre_costs_more_the_nearer_an_obstacle_is(two_rooms):
    price = prices(two_rooms, RADIUS_M, CAUTION, through_unknown=False)
    assert price[40, 30] == 1.0  # 1.5 m from every wall
    row = price[50, 45:56]  # towards the wall at column 60, up to 0.25 m from it
    assert (np.diff(row) >= 0).all()
    assert np.isinf(price[50, 57:60]).all()
    assert np.isfinite(price[30, 60])  # in the middle of the door


def test_the_unknown_is_driven_through_only_when_asked_to():
    cells = np.full((20, 20), UNKNOWN, np.uint8)
    cells[0, 0] = OCCUPIED
    grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)
    assert np.isinf(prices(grid, RADIUS_M, CAUTION, through_unknown=False)).all()
    assert prices(grid, RADIUS_M, CAUTION, through_unknown=True)[19, 19] == pytest.approx(1.2)
