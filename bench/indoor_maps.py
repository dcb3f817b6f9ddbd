"""Occupancy maps of made-up homes: rooms, doors and furniture at 0.05 m, seen from above."""

import numpy as np

from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid

RESOLUTION_M = 0.05
WALL_CELLS = 3
DOOR_CELLS = 18  # 0.9 m
DOOR_CLEARING_CELLS = 9  # furniture keeps out of doorways
SMALLEST_ROOM_CELLS = 40  # 2 m
CELLS_PER_THING = 2000  # one piece of furniture on every 5 square metres


def indoor_map(size: int, seed: int) -> OccupancyGrid:
    """A square home, `size` cells wide."""
    rng = np.random.default_rng(seed)
    cells = np.full((size, size), FREE, np.uint8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    walls = []
    split_room(cells, walls, (2, 2, size - 2, size - 2), rng)
    doors = [door for wall in walls if (door := place_door(cells, wall, rng)) is not None]
    for _ in range(size * size // CELLS_PER_THING):
        place_thing(cells, rng)
    for low_y, low_x, high_y, high_x in doors:
        cells[low_y:high_y, low_x:high_x] = FREE
    return OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=RESOLUTION_M)


def split_room(cells, walls, room, rng) -> None:
    """Divide a room (low y, low x, high y, high x) across its longer side until the parts are rooms of a home."""
    low_y, low_x, high_y, high_x = room
    height, width = high_y - low_y, high_x - low_x
    longer = max(height, width)
    if longer < 2 * SMALLEST_ROOM_CELLS + WALL_CELLS or (longer < 3 * SMALLEST_ROOM_CELLS and rng.random() < 0.4):
        return
    at = int(rng.integers(SMALLEST_ROOM_CELLS, longer - SMALLEST_ROOM_CELLS - WALL_CELLS + 1))
    if height >= width:
        wall = (low_y + at, low_x, low_y + at + WALL_CELLS, high_x)
        rooms = ((low_y, low_x, wall[0], high_x), (wall[2], low_x, high_y, high_x))
    else:
        wall = (low_y, low_x + at, high_y, low_x + at + WALL_CELLS)
        rooms = ((low_y, low_x, high_y, wall[1]), (low_y, wall[3], high_y, high_x))
    cells[wall[0] : wall[2], wall[1] : wall[3]] = OCCUPIED
    walls.append(wall)
    for part in rooms:
        split_room(cells, walls, part, rng)


def place_door(cells, wall, rng) -> tuple[int, int, int, int] | None:
    """Where a wall gets its door: anywhere with free floor on both sides; None if no place is wide enough."""
    low_y, low_x, high_y, high_x = wall
    along_x = high_x - low_x > high_y - low_y
    if along_x:
        open_floor = (cells[low_y - 1, low_x:high_x] == FREE) & (cells[high_y, low_x:high_x] == FREE)
    else:
        open_floor = (cells[low_y:high_y, low_x - 1] == FREE) & (cells[low_y:high_y, high_x] == FREE)
    places = np.flatnonzero(np.convolve(open_floor, np.ones(DOOR_CELLS), "valid") == DOOR_CELLS)
    if not len(places):
        return None
    at, deep = int(rng.choice(places)), DOOR_CLEARING_CELLS
    if along_x:
        return low_y - deep, low_x + at, high_y + deep, low_x + at + DOOR_CELLS
    return low_y + at, low_x - deep, low_y + at + DOOR_CELLS, high_x + deep


def place_thing(cells, rng) -> None:
    """Put down a round thing, a straight box or one at an angle."""
    rows, columns = np.mgrid[: cells.shape[0], : cells.shape[1]]
    y, x = rows - rng.uniform(0, cells.shape[0]), columns - rng.uniform(0, cells.shape[1])
    kind = rng.choice(["round", "straight", "turned"], p=[0.3, 0.5, 0.2])
    if kind == "round":
        cells[x**2 + y**2 < rng.uniform(2, 8) ** 2] = OCCUPIED
        return
    angle = rng.uniform(0, np.pi) if kind == "turned" else 0.0
    half_length, half_width = rng.uniform(4, 18), rng.uniform(3, 9)
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    if rng.random() < 0.5:
        along, across = across, along
    cells[(np.abs(along) < half_length) & (np.abs(across) < half_width)] = OCCUPIED
