import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.order.stable_hash import Draw, mix64, permutation, splitmix64

GAMMA = 0x9E3779B97F4A7C15
WORD = st.integers(0, 2**64 - 1)


def splitmix64_of_the_paper(state: int) -> int:
    """One word with Python's integers, as in Steele, Lea, Flood (2014) with Stafford's variant 13."""
    z = (state + GAMMA) % 2**64
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
    return z ^ (z >> 31)


def test_the_generator_gives_its_published_numbers() -> None:
    """First outputs of splitmix64.c (Vigna) for seed 1234567, and of Java's SplittableRandom for seed 0."""
    states = np.array([(1234567 + number * GAMMA) % 2**64 for number in range(5)], np.uint64)
    assert splitmix64(states).tolist() == [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    assert hex(int(splitmix64(np.zeros(1, np.uint64))[0])) == "0xe220a8397b1dcdaf"


@given(st.lists(WORD, max_size=5))
def test_arrays_are_hashed_word_by_word(states: list[int]) -> None:
    found = splitmix64(np.array(states, np.uint64)).tolist()
    assert found == [splitmix64_of_the_paper(state) for state in states]


@given(st.integers(0, 2**63 - 1), st.lists(WORD, max_size=4))
def test_a_hash_is_a_chain_over_the_words_and_the_value(value: int, words: list[int]) -> None:
    key = 0
    for word in words:
        key = splitmix64_of_the_paper(key ^ word)
    assert int(mix64(np.array([value]), *words)[0]) == splitmix64_of_the_paper(key ^ value)


def test_hashes_are_those_of_every_run_so_far() -> None:
    """Orders of runs that were saved depend on these numbers: they must never change."""
    assert mix64(np.arange(3), 7, Draw.BLOCKS).tolist() == [
        8075172986249684972,
        14574897457539200646,
        1650069959653123811,
    ]
    assert [int(draw) for draw in (Draw.BLOCKS, Draw.CLIPS, Draw.STEPS, Draw.CHUNK_SIZES)] == [1, 2, 3, 4]


def test_the_values_stay_as_they_are() -> None:
    values = np.arange(5, dtype=np.uint64)
    mix64(values, 3)
    hashes = splitmix64(values)
    permutation(hashes)
    assert values.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(hashes, splitmix64(values))


@given(st.lists(st.integers(0, 9), max_size=8).filter(lambda sizes: sum(sizes) > 0), st.integers(0, 100))
def test_numbers_are_permuted_within_their_groups(sizes: list[int], seed: int) -> None:
    hashes = mix64(np.arange(sum(sizes)), seed)
    found = permutation(hashes, np.array(sizes))
    start = 0
    for size in sizes:
        own = range(start, start + size)
        assert found[start : start + size].tolist() == sorted(own, key=lambda number: int(hashes[number]))
        start += size


def test_groups_larger_than_what_is_sorted_at_once_are_sorted_whole() -> None:
    sizes = np.array([40_000, 1, 0, 20_000, 16_384, 3])
    hashes = mix64(np.arange(sizes.sum()), 5)
    groups = np.repeat(np.arange(len(sizes)), sizes)
    np.testing.assert_array_equal(permutation(hashes, sizes), np.lexsort((hashes, groups)))


def test_equal_hashes_keep_their_order() -> None:
    assert permutation(np.full(5, 7, np.uint64)).tolist() == [0, 1, 2, 3, 4]


def test_no_numbers_have_an_empty_permutation() -> None:
    assert permutation(np.empty(0, np.uint64)).tolist() == []
    assert permutation(np.zeros(1, np.uint64)).tolist() == [0]


def test_every_place_is_equally_likely() -> None:
    """4,000 seeds over 8 numbers: each number stands in each place 500 times, give or take 5 standard deviations."""
    counts = np.zeros((8, 8), np.int64)
    for seed in range(4000):
        counts[np.arange(8), permutation(mix64(np.arange(8), seed))] += 1
    assert abs(counts - 500).max() < 5 * (4000 * 1 / 8 * 7 / 8) ** 0.5


def test_too_many_groups_of_too_many_numbers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wsm_data.loaders.order.stable_hash._WORD_BITS", 6)
    with pytest.raises(ValueError, match="8 numbers in 8 groups leave no bit for the hash"):
        permutation(np.zeros(8, np.uint64), np.ones(8, np.int64))
