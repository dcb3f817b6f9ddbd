"""Ways through a home that keep away from obstacles: a graph over map cells."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.drive.occupancy import CELL_M, Clearance

_CROWDING = 6.0
"""How many times longer a way may be to avoid driving at the least clearance."""

_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True, kw_only=True)
class CellGraph:
    """Free cells that are connected with one another, and the cost of going between neighbours.

    Attributes:
        cells: row-major index in the map of each node; int64 [N].
        costs: symmetric matrix of costs, in m of unhindered way; [N, N].
        clearance: the map.
    """

    cells: NDArray[np.int64]
    costs: sparse.csr_array
    clearance: Clearance


def cell_graph(clearance: Clearance, least_m: float, comfortable_m: float) -> CellGraph:
    """Graph of the largest connected part of the cells with at least `least_m` of clearance.

    Args:
        clearance: the map.
        least_m: cells nearer to obstacles are not driven on.
        comfortable_m: below this clearance every metre costs more, up to 1 + 6 times at the least one.
    """
    labels, count = ndimage.label(clearance.distance_m > least_m, structure=np.ones((3, 3)))
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    free = (labels == int(np.argmax(sizes))) & (labels > 0)
    number = np.full(free.shape, -1, np.int64)
    number[free] = np.arange(int(free.sum()))
    lack = np.clip((comfortable_m - clearance.distance_m) / (comfortable_m - least_m), 0.0, 1.0)
    price = 1.0 + _CROWDING * lack * lack
    sources, targets, costs = [], [], []
    for down, right in _STEPS:
        here, there = _shifted(number, down, right)
        price_here, price_there = _shifted(price, down, right)
        both = (here >= 0) & (there >= 0)
        sources.append(here[both])
        targets.append(there[both])
        costs.append(np.hypot(down, right) * CELL_M * 0.5 * (price_here + price_there)[both])
    size = int(free.sum())
    source, target, cost = np.concatenate(sources), np.concatenate(targets), np.concatenate(costs)
    half = sparse.coo_array((cost, (source, target)), shape=(size, size)).tocsr()
    return CellGraph(cells=np.flatnonzero(free), costs=half + half.T, clearance=clearance)


def _shifted(array: "np.ndarray", down: int, right: int) -> tuple["np.ndarray", "np.ndarray"]:
    """Every cell beside its neighbour `down` rows and `right` columns on."""
    rows, columns = array.shape
    a = array[: rows - down, max(0, -right) : columns - max(0, right)]
    b = array[down:, max(0, right) : columns + min(0, right)]
    return a, b


def ways_from(graph: CellGraph, start: int) -> tuple[Float64Array, NDArray[np.int32]]:
    """Cost of the best way from node `start` to every node, and the node before each on it (-9999 for none)."""
    cost, before = csgraph.dijkstra(graph.costs, indices=start, return_predecessors=True)
    return np.asarray(cost), np.asarray(before)


def way_to(graph: CellGraph, before: NDArray[np.int32], goal: int) -> Float64Array:
    """Cell centres from the start to node `goal`, world, m; float64 [N, 2]."""
    nodes = [goal]
    while before[nodes[-1]] >= 0:
        nodes.append(int(before[nodes[-1]]))
    return graph.clearance.centres(graph.cells[np.array(nodes[::-1])])
