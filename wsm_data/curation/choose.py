"""The walk from the hardest clip down: each is taken unless a quota is full or its path is a near-duplicate.

Places that must have a number of clips are served first: clips that several of them wait for, then two, then one, each
time from the hardest down. What is left is filled from the hardest down. This is greedy: where bounds of several kinds
are tight together, other clips might have met them, and the error says which bound was left.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from wsm_data.curation.diversity import SAME_FLOOR_M, paths_are_near
from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.quotas import QuotaTable
from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import BoolArray, Float32Array

PathReader = Callable[[NDArray[np.int64]], Outlines]
"""From numbers of clips, int64 [M], to the outlines of their paths."""

_LEAST_BLOCK = 1 << 16
_CHOSEN, _NEAR, _FULL = 0, 1, 2
_NO_CLIP = -1


@dataclass(frozen=True, kw_only=True, eq=False)
class Chosen:
    """What the walk took.

    Attributes:
        places: chosen clips by their place in the walk, ascending: hardest first; int64 [n].
        near_duplicates: clips left out for one that was taken before them and whose path is nearly the same: a harder
            one, or one that a quota asked for.
        over_quota: clips left out because a quota was full.
    """

    places: NDArray[np.int64]
    near_duplicates: int
    over_quota: int


@dataclass(frozen=True, kw_only=True, eq=False)
class _State:
    """What was taken so far. A chosen clip stands in the chain of the hash of its scene and of the cell it starts in.

    Attributes:
        taken: clips of each place of the quotas; int64 [P].
        is_chosen: of each candidate; bool [N].
        stored: candidates by the order in which they were taken; int64 [count].
        paths: outlines of the taken clips; float32 [count, P, 2].
        floors_m: heights of their floors; float32 [count].
        heads: first clip of each chain, as a number in `stored`; int64 [power of two].
        following: next clip of the same chain; int64 [count].
        totals: taken, near-duplicates, over quota; int64 [3].
    """

    taken: NDArray[np.int64]
    is_chosen: BoolArray
    stored: NDArray[np.int64]
    paths: Float32Array
    floors_m: Float32Array
    heads: NDArray[np.int64]
    following: NDArray[np.int64]
    totals: NDArray[np.int64]


def choose_clips(
    quotas: QuotaTable, scenes: NDArray[np.int32], count: int, within_m: float, read_paths: PathReader
) -> Chosen:
    """Take `count` clips.

    Args:
        quotas: bounds, with the codes of the candidates in the order of the walk, hardest first.
        scenes: number of each candidate's physical scene; int32 [N].
        count: clips to take.
        within_m: largest distance of near-duplicate paths, m; 0 takes all and reads no path.
        read_paths: asked for the paths of candidates when the walk comes to them.

    Raises:
        ConfigError: a quota cannot be met, or too few clips can be taken; says what was in the way.
    """
    state = _State(
        taken=np.zeros(len(quotas.names), np.int64),
        is_chosen=np.zeros(len(scenes), bool),
        stored=np.zeros(count, np.int64),
        paths=np.zeros((count, 0, 2), np.float32),
        floors_m=np.zeros(count, np.float32),
        heads=np.full(1 << max(10, (2 * count).bit_length()), _NO_CLIP, np.int64),
        following=np.full(count, _NO_CLIP, np.int64),
        totals=np.zeros(3, np.int64),
    )
    for wanted_by in range(len(quotas.codes), -1, -1):
        state = _pass(state, quotas, scenes, count, within_m, read_paths, wanted_by)
    _require_least(quotas, state)
    _require_count(quotas, state, count, within_m)
    return Chosen(
        places=np.sort(state.stored[: state.totals[_CHOSEN]]),
        near_duplicates=int(state.totals[_NEAR]),
        over_quota=int(state.totals[_FULL]),
    )


def _pass(
    state: _State,
    quotas: QuotaTable,
    scenes: NDArray[np.int32],
    count: int,
    within_m: float,
    read_paths: PathReader,
    wanted_by: int,
) -> _State:
    """Go through all candidates once and take those that so many places wait for."""
    first = 0
    while first < len(scenes) and state.totals[_CHOSEN] < count:
        if wanted_by and not (state.taken < quotas.least).any():
            break
        left = count - int(state.totals[_CHOSEN])
        block = np.arange(first, min(first + max(_LEAST_BLOCK, left + left // 4), len(scenes)))
        first += len(block)
        waiting = (state.taken < quotas.least)[quotas.codes[:, block]].sum(axis=0)
        block = block[(waiting >= wanted_by) & ~state.is_chosen[block]]
        paths = read_paths(block) if within_m else _no_outlines(len(block))
        if state.paths.shape[1] != paths.xy_m.shape[1]:  # known from the first block on
            state = _with_room(state, paths.xy_m.shape[1])
        _walk(
            block, paths.xy_m, paths.floor_z_m, scenes, quotas.codes, quotas.least, quotas.most, wanted_by, within_m,
            state.taken, state.is_chosen, state.stored, state.paths, state.floors_m, state.heads, state.following,
            state.totals,
        )  # fmt: skip
    return state


def _with_room(state: _State, points: int) -> _State:
    return _State(**{**vars(state), "paths": np.zeros((len(state.stored), points, 2), np.float32)})


def _no_outlines(clips: int) -> Outlines:
    return Outlines(xy_m=np.zeros((clips, 0, 2), np.float32), floor_z_m=np.zeros(clips, np.float32))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _walk(
    block: NDArray[np.int64], paths: Float32Array, floors_m: Float32Array, scenes: NDArray[np.int32],
    codes: NDArray[np.int32], least: NDArray[np.int64], most: NDArray[np.int64], wanted_by: int, within_m: float,
    taken: NDArray[np.int64], is_chosen: BoolArray, stored: NDArray[np.int64], stored_paths: Float32Array,
    stored_floors_m: Float32Array, heads: NDArray[np.int64], following: NDArray[np.int64], totals: NDArray[np.int64],
) -> None:  # fmt: skip
    """Take clips of a block one after the other until there are enough."""
    for number in range(len(block)):
        if totals[_CHOSEN] == len(stored):
            return
        clip = block[number]
        waiting, full = 0, False
        for kind in range(len(codes)):
            place = codes[kind, clip]
            waiting += taken[place] < least[place]
            full = full or taken[place] >= most[place]
        if waiting < wanted_by:
            continue
        if full:
            totals[_FULL] += wanted_by == 0
            continue
        if within_m > 0 and _is_near(
            paths[number], floors_m[number], scenes[clip], within_m, scenes, stored, stored_paths, stored_floors_m,
            heads, following,
        ):  # fmt: skip
            totals[_NEAR] += wanted_by == 0
            continue
        entry = totals[_CHOSEN]
        stored[entry], is_chosen[clip] = clip, True
        totals[_CHOSEN] += 1
        for kind in range(len(codes)):
            taken[codes[kind, clip]] += 1
        if within_m > 0:
            stored_paths[entry], stored_floors_m[entry] = paths[number], floors_m[number]
            chain = _chain(
                scenes[clip], _cell(paths[number, 0, 0], within_m), _cell(paths[number, 0, 1], within_m), len(heads)
            )
            following[entry], heads[chain] = heads[chain], entry


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _is_near(
    path: Float32Array, floor_m: float, scene: int, within_m: float, scenes: NDArray[np.int32],
    stored: NDArray[np.int64], stored_paths: Float32Array, stored_floors_m: Float32Array, heads: NDArray[np.int64],
    following: NDArray[np.int64],
) -> bool:  # fmt: skip
    """Whether a path is near one that was taken on its floor: those that start in its cell or in one beside it."""
    column, row = _cell(path[0, 0], within_m), _cell(path[0, 1], within_m)
    for right in range(-1, 2):
        for down in range(-1, 2):
            entry = heads[_chain(scene, column + right, row + down, len(heads))]
            while entry >= 0:
                same_floor = (
                    scenes[stored[entry]] == scene
                    and abs(np.float64(floor_m) - np.float64(stored_floors_m[entry])) <= SAME_FLOOR_M
                )
                if same_floor and paths_are_near(path, stored_paths[entry], within_m):
                    return True
                entry = following[entry]
    return False


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _cell(coordinate_m: float, within_m: float) -> int:
    """Number of a cell: a little wider than paths may be apart, so that rounding does not put one cell between them."""
    return int(np.floor(np.float64(coordinate_m) / (1.001 * within_m)))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _chain(scene: int, column: int, row: int, chains: int) -> int:
    """Spatial hash of Teschner et al., "Optimized spatial hashing", VMV 2003; `chains` is a power of two."""
    return (column * 73856093 ^ row * 19349663 ^ scene * 83492791) & (chains - 1)


def _require_least(quotas: QuotaTable, state: _State) -> None:
    left = np.flatnonzero(state.taken < quotas.least)
    if len(left):
        place = left[0]
        raise ConfigError(
            f"the quota of {quotas.names[place]} cannot be met: at least {quotas.least[place]} clips are asked for, "
            f"and {state.taken[place]} could be taken beside the other quotas, near-duplicates left out"
        )


def _require_count(quotas: QuotaTable, state: _State, count: int, within_m: float) -> None:
    chosen, near, over = (int(number) for number in state.totals)
    if chosen == count:
        return
    full = [quotas.names[place] for place in np.flatnonzero(state.taken >= quotas.most)]
    reasons = []
    if near:
        reasons.append(
            f"{near} clips are near-duplicates of ones that were taken before (diversity.within_m = {within_m:g})"
        )
    if over:
        reasons.append(f"{over} are over the quota of {', '.join(full[:5])}{', ...' if len(full) > 5 else ''}")
    if chosen + near + over < count:
        reasons.append(f"there are {chosen + near + over} candidates")
    raise ConfigError(
        f"{count} clips are to be chosen, and only {chosen} can be: {'; '.join(reasons)}. Choose a smaller fraction, "
        "or loosen what is in the way"
    )
