import math

import numpy as np

from wsm_data.maps.bands import fill_bands


def best_over_the_rim(opaque, walls, distance, goal, reach, sees):
    """The definition, cell by cell: every rim cell and the goal in sight and in reach are tried."""
    filled = distance.copy()
    padded = np.pad(opaque, 1, constant_values=True)
    beside = sum(padded[1 + dy : 1 + dy + len(opaque), 1 + dx : 1 + dx + opaque.shape[1]].astype(int)
                 for dy in (-1, 0, 1) for dx in (-1, 0, 1))  # fmt: skip
    rim = [(int(x), int(y)) for y, x in np.argwhere(~opaque & (beside > 0) & np.isfinite(distance))]
    for row, column in np.argwhere(opaque & ~walls):
        here = (int(column), int(row))
        ways = [distance[y, x] + math.hypot(x - column, y - row) for x, y in rim
                if math.hypot(x - column, y - row) <= reach and sees(walls, here, (x, y))]  # fmt: skip
        to_goal = math.hypot(goal[0] - column, goal[1] - row)
        if to_goal <= reach and sees(walls, here, goal):
            ways.append(to_goal)
        filled[row, column] = min(ways, default=np.inf)
    return filled


def test_every_cell_beside_an_obstacle_takes_the_best_rim_cell_it_sees(sees):
    rng = np.random.default_rng(5)
    for _ in range(6):
        walls = rng.random((22, 26)) > 0.9
        walls[[0, -1]] = walls[:, [0, -1]] = True
        opaque = walls | (rng.random(walls.shape) > 0.6)
        distance = np.where(opaque, np.inf, rng.uniform(0, 30, walls.shape))
        distance[rng.random(walls.shape) > 0.9] = np.inf  # traversable, but not reached
        goal, reach = (12, 9), 4.3
        found = fill_bands(opaque, walls, distance, goal[0] + 0.5, goal[1] + 0.5, reach)
        expected = best_over_the_rim(opaque, walls, distance, goal, reach, sees)
        assert np.isfinite(expected[opaque]).any()
        np.testing.assert_allclose(found, expected, rtol=1e-14)
