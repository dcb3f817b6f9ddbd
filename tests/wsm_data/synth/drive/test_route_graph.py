import numpy as np
import pytest

from wsm_data.synth.drive.occupancy import CELL_M, Clearance
from wsm_data.synth.drive.route_graph import cell_graph, way_to, ways_from


def field(distance_m: np.ndarray) -> Clearance:
    return Clearance(distance_m=distance_m, origin_m=(0.0, 0.0))


def node(graph, row: int, column: int) -> int:
    return int(np.flatnonzero(graph.cells == row * graph.clearance.distance_m.shape[1] + column)[0])


def test_in_the_open_a_way_costs_its_length():
    graph = cell_graph(field(np.full((20, 30), 2.0)), 0.3, 0.6)
    cost, _ = ways_from(graph, node(graph, 0, 0))
    assert cost[node(graph, 0, 10)] == pytest.approx(10 * CELL_M)
    assert cost[node(graph, 10, 10)] == pytest.approx(10 * np.sqrt(2) * CELL_M)
    assert cost[node(graph, 10, 0)] == pytest.approx(10 * CELL_M)


def test_crowded_cells_are_avoided_when_there_is_room():
    distance = np.full((21, 41), 2.0)
    distance[10, 5:36] = 0.31  # a narrow lane straight ahead, open floor beside it
    graph = cell_graph(field(distance), 0.3, 0.6)
    cost, before = ways_from(graph, node(graph, 10, 0))
    way = way_to(graph, before, node(graph, 10, 40))
    rows = np.floor(way[:, 1] / CELL_M)
    assert (rows == 10).mean() < 0.5
    assert cost[node(graph, 10, 40)] < 1.1 * 40 * CELL_M


def test_only_the_largest_connected_part_is_driven_on():
    distance = np.full((10, 20), 1.0)
    distance[:, 6] = 0.0
    graph = cell_graph(field(distance), 0.3, 0.6)
    assert len(graph.cells) == 10 * 13
    assert (graph.cells % 20 > 6).all()


def test_a_way_starts_and_ends_where_it_was_asked_to_and_takes_neighbouring_cells():
    distance = np.full((30, 30), 1.0)
    distance[:20, 15] = 0.0
    graph = cell_graph(field(distance), 0.3, 0.6)
    start, goal = node(graph, 2, 2), node(graph, 2, 27)
    _, before = ways_from(graph, start)
    way = way_to(graph, before, goal)
    assert way[0] == pytest.approx((2.5 * CELL_M, 2.5 * CELL_M))
    assert way[-1] == pytest.approx((27.5 * CELL_M, 2.5 * CELL_M))
    assert np.abs(np.diff(way, axis=0)).max() < 1.01 * CELL_M
    assert way[:, 1].max() > 20 * CELL_M  # round the wall
