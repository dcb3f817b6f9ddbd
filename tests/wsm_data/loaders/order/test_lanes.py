from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder
from wsm_data.loaders.order.lanes import EMPTY_ROW, bucket_lanes, deal_lanes

ROWS = st.integers(1, 120)
BATCH = st.integers(1, 17)
EITHER = st.booleans()


def deal(rows: int, batch: int, shuffle: bool, remainder: Remainder) -> np.ndarray:
    return deal_lanes(rows, OrderConfig(global_batch=batch, shuffle=shuffle, remainder=remainder))


@given(ROWS, BATCH, EITHER)
def test_drop_deals_full_steps_and_no_row_twice(rows: int, batch: int, shuffle: bool) -> None:
    slots = deal(rows, batch, shuffle, Remainder.DROP)
    assert slots.shape == (batch, rows // batch)
    dealt = slots.ravel().tolist()
    assert len(set(dealt)) == len(dealt)
    assert set(dealt) <= set(range(rows))


@given(ROWS, BATCH, EITHER)
def test_pad_deals_every_row_once_and_leaves_slots_of_the_last_step_empty(rows: int, batch: int, shuffle: bool) -> None:
    slots = deal(rows, batch, shuffle, Remainder.PAD)
    assert slots.shape == (batch, -(-rows // batch))
    assert sorted(slots[slots != EMPTY_ROW].tolist()) == list(range(rows))
    assert (slots[:, :-1] != EMPTY_ROW).all()


@given(ROWS, BATCH, EITHER)
def test_repeat_fills_the_last_step_with_rows_from_the_beginning(rows: int, batch: int, shuffle: bool) -> None:
    padded, repeated = (deal(rows, batch, shuffle, remainder) for remainder in (Remainder.PAD, Remainder.REPEAT))
    fill = repeated[padded == EMPTY_ROW].tolist()
    assert fill == [number % rows for number in range(len(fill))]
    np.testing.assert_array_equal(repeated[padded != EMPTY_ROW], padded[padded != EMPTY_ROW])


@given(ROWS, BATCH)
def test_drop_is_pad_without_its_last_unfilled_step(rows: int, batch: int) -> None:
    dropped, padded = (deal(rows, batch, True, remainder) for remainder in (Remainder.DROP, Remainder.PAD))
    np.testing.assert_array_equal(dropped, padded[:, : rows // batch])


@given(ROWS, BATCH)
def test_a_slot_reads_along_a_stretch_of_its_own(rows: int, batch: int) -> None:
    slots = deal(rows, batch, True, Remainder.PAD)
    lanes = [lane[lane != EMPTY_ROW].tolist() for lane in slots]
    assert [number for lane in lanes for number in lane] == list(range(rows))
    assert max(map(len, lanes)) - min(map(len, lanes)) <= 1


def test_without_shuffle_steps_are_consecutive_rows() -> None:
    assert deal(7, 3, False, Remainder.PAD).T.tolist() == [[0, 1, 2], [3, 4, 5], [6, EMPTY_ROW, EMPTY_ROW]]


LENGTHS = st.integers(1, 4).flatmap(
    lambda batch: st.integers(1, 20).flatmap(
        lambda steps: st.tuples(
            st.just(batch), st.lists(st.integers(1, 9), min_size=batch * steps, max_size=batch * steps)
        )
    )
)


def bucket_order(batch: int, pool: int, shuffle: bool = True, seed: int = 0) -> OrderConfig:
    return OrderConfig(global_batch=batch, arrangement=Arrangement.BUCKET, pool=pool, shuffle=shuffle, seed=seed)


@given(LENGTHS, st.integers(1, 6), st.integers(0, 3))
def test_rows_keep_their_lane_and_their_pool(dealt: tuple[int, list[int]], pool: int, epoch: int) -> None:
    batch, lengths = dealt
    order = bucket_order(batch, pool)
    slots = deal_lanes(len(lengths), order)
    found = bucket_lanes(slots, np.array(lengths), order, epoch)
    for first in range(0, slots.shape[1], pool):
        stretch = slice(first, first + pool)
        for lane in range(batch):
            assert Counter(found[lane, stretch].tolist()) == Counter(slots[lane, stretch].tolist())


@given(LENGTHS, st.integers(1, 6))
def test_the_rows_of_a_step_have_the_same_quantile_of_length_in_their_lanes(
    dealt: tuple[int, list[int]], pool: int
) -> None:
    batch, lengths = dealt
    order = bucket_order(batch, pool)
    slots = deal_lanes(len(lengths), order)
    found = bucket_lanes(slots, np.array(lengths), order, 0)
    for first in range(0, slots.shape[1], pool):
        stretch = slice(first, first + pool)
        by_length = [sorted(lane.tolist(), key=lambda row: lengths[row]) for lane in slots[:, stretch]]
        wanted = set(zip(*by_length, strict=True))  # equal lengths in the order in which they came
        assert {tuple(step) for step in found[:, stretch].T.tolist()} == wanted


def test_steps_of_a_pool_come_in_another_order_each_epoch_unless_nothing_is_shuffled() -> None:
    lengths = np.tile(np.arange(1, 33), 2)
    for shuffle, orders in ((True, 5), (False, 1)):
        order = bucket_order(2, 32, shuffle)
        slots = deal_lanes(64, order)
        found = {tuple(lengths[bucket_lanes(slots, lengths, order, epoch)[0]].tolist()) for epoch in range(5)}
        assert len(found) == orders
