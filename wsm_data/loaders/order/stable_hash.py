"""Hashes that stand in for random numbers: the same on every machine, with every version of numpy, for ever.

An epoch must come back in the same order years later, on another machine and under another numpy, whose generators
promise no such thing. The function is the output step of SplitMix64 (Steele, Lea, Flood: Fast Splittable Pseudorandom
Number Generators, OOPSLA 2014), which maps 64-bit words one to one.
"""

from enum import IntEnum
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import Int64Array

Uint64Array = NDArray[np.uint64]

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_FIRST_FACTOR = np.uint64(0xBF58476D1CE4E5B9)
_SECOND_FACTOR = np.uint64(0x94D049BB133111EB)
_WORD_BITS = 64
_SORTED_AT_ONCE = 1 << 14


class Draw(IntEnum):
    """What is drawn: no two draws of one seed see the same numbers. Part of every order ever made: never renumber."""

    BLOCKS = 1
    CLIPS = 2
    STEPS = 3
    CHUNK_SIZES = 4
    REPLAN_LATENTS = 5


def splitmix64(states: Uint64Array) -> Uint64Array:
    """What a SplitMix64 generator in each of these states returns next."""
    z = states + _GAMMA
    scratch = np.empty_like(z)
    for shift, factor in ((30, _FIRST_FACTOR), (27, _SECOND_FACTOR)):
        z ^= np.right_shift(z, np.uint64(shift), out=scratch)
        z *= factor
    z ^= np.right_shift(z, np.uint64(31), out=scratch)
    return z


def mix64(values: NDArray[np.integer], *words: int) -> Uint64Array:
    """Hash each value together with the words: distinct values give distinct hashes under the same words.

    Args:
        values: non-negative integers of any shape.
        words: what the hashes depend on besides, such as seed and epoch; their order counts.
    """
    return splitmix64(values.astype(np.uint64) ^ _key(words))


@lru_cache(maxsize=64)
def _key(words: tuple[int, ...]) -> Uint64Array:
    """What the words come to; uint64 [1]."""
    key = np.zeros(1, np.uint64)
    for word in words:
        key = splitmix64(key ^ np.uint64(word))
    return key


def permutation(hashes: Uint64Array, group_sizes: Int64Array | None = None) -> Int64Array:
    """Numbers 0 to n - 1 permuted within groups of consecutive ones: by hash, and by number where hashes agree.

    Everything goes into one 64-bit word (group, leading bits of the hash, number), so that plain sorting is enough and
    no two words are equal: the outcome does not depend on the method by which numpy sorts.

    Args:
        hashes: one for each number; uint64 [n].
        group_sizes: sizes of the groups, which add up to n; int64 [groups]. None for a single group.

    Raises:
        ValueError: group and number leave no bit for the hash.
    """
    sizes = np.array([len(hashes)]) if group_sizes is None else group_sizes
    number_bits = max(len(hashes) - 1, 1).bit_length()
    group_bits = max(len(sizes) - 1, 0).bit_length()
    hash_bits = _WORD_BITS - number_bits - group_bits
    if hash_bits < 1:
        raise ValueError(f"{len(hashes)} numbers in {len(sizes)} groups leave no bit for the hash")
    words = hashes >> np.uint64(_WORD_BITS - hash_bits)
    words <<= np.uint64(number_bits)
    words |= np.arange(len(hashes), dtype=np.uint64)
    if group_bits:
        words |= np.repeat(np.arange(len(sizes), dtype=np.uint64) << np.uint64(_WORD_BITS - group_bits), sizes)
    for first, end in pairwise(_stretches(sizes)):
        words[first:end].sort()
    words &= np.uint64((1 << number_bits) - 1)
    return words.view(np.int64)


def _stretches(sizes: Int64Array) -> list[int]:
    """Borders of groups about `_SORTED_AT_ONCE` apart: what fits into the cache is sorted several times as fast."""
    ends = np.cumsum(sizes)
    last_of_each = np.flatnonzero(np.diff(ends // _SORTED_AT_ONCE, append=-1))
    return [0, *ends[last_of_each].tolist()]
