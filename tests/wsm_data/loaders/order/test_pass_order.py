import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.pass_order import SourceLayout, pass_order
from wsm_data.loaders.order.stable_hash import Draw, mix64

SHARDS = st.lists(st.integers(1, 12), min_size=1, max_size=12)
SETTINGS = st.builds(
    OrderConfig, seed=st.integers(0, 5), block_clips=st.integers(0, 5), window_blocks=st.integers(1, 6)
)


def slow_order(shards: list[int], order: OrderConfig, source: int, number: int) -> list[int]:
    """Blocks and windows as lists: what the documentation says, word for word."""

    def permuted(items: list, numbers: list[int], draw: Draw) -> list:
        hashes = mix64(np.array(numbers, np.int64), order.seed, draw, source, number)
        return [items[place] for place in np.argsort(hashes, kind="stable")]

    blocks, clip = [], 0
    for size in shards:
        own = list(range(clip, clip + size))
        step = order.block_clips or size
        blocks += [own[first : first + step] for first in range(0, size, step)]
        clip += size
    blocks = permuted(blocks, list(range(len(blocks))), Draw.BLOCKS)
    found = []
    for first in range(0, len(blocks), order.window_blocks):
        window = [clip for block in blocks[first : first + order.window_blocks] for clip in block]
        found += permuted(window, window, Draw.CLIPS)
    return found


@given(SHARDS, SETTINGS, st.integers(0, 2), st.integers(0, 3))
def test_blocks_are_permuted_and_then_the_clips_of_each_window(
    shards: list[int], order: OrderConfig, source: int, number: int
) -> None:
    found = pass_order(np.array(shards), order, source=source, number=number)
    assert found.tolist() == slow_order(shards, order, source, number)
    assert sorted(found.tolist()) == list(range(sum(shards)))


def test_without_shuffle_clips_come_as_they_are_stored() -> None:
    order = OrderConfig(shuffle=False)
    assert pass_order(np.array([2, 3]), order, source=0, number=4).tolist() == [0, 1, 2, 3, 4]


def test_orders_differ_by_seed_source_and_pass() -> None:
    shards = np.full(10, 20)
    orders = [
        pass_order(shards, OrderConfig(seed=seed), source=source, number=number).tolist()
        for seed, source, number in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
    ]
    assert len({tuple(order) for order in orders}) == 5


def test_the_order_of_a_seed_stays_what_it_was() -> None:
    """Runs that were saved go on in it: it must not change, with whatever version of numpy."""
    order = OrderConfig(seed=3, block_clips=2, window_blocks=2)
    assert pass_order(np.array([5, 4, 3]), order, source=0, number=1).tolist() == [6, 4, 5, 9, 10, 3, 2, 7, 11, 8, 0, 1]


def test_a_source_without_clips_has_an_empty_order() -> None:
    assert pass_order(np.empty(0, np.int64), OrderConfig(), source=0, number=0).tolist() == []


@pytest.mark.parametrize("shard_clips", [[2, 2], [3, 0], [6]])
def test_shards_that_do_not_hold_the_clips_are_refused(shard_clips: list[int]) -> None:
    with pytest.raises(ValueError, match="add up to the 3 clips"):
        SourceLayout(shard_clips=np.array(shard_clips), latents=np.ones(3, np.int32))
