"""An order of clips that has nothing to do with what they are: by a hash of their key. It decides between equals."""

import numba
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

_FNV_OFFSET = np.uint64(0xCBF29CE484222325)
_FNV_PRIME = np.uint64(0x100000001B3)


def key_hashes(keys: pa.StringArray) -> NDArray[np.uint64]:
    """64-bit hash of the UTF-8 bytes of every key: FNV-1a, then the finaliser of splitmix64; uint64 [N].

    FNV-1a (Fowler, Noll and Vo) mixes its last bytes little, and keys differ in their last digits: the finaliser
    (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014) spreads them.
    """
    _, offsets, data = keys.buffers()
    ends = np.frombuffer(offsets, np.int32)[keys.offset : keys.offset + len(keys) + 1]
    text = np.frombuffer(data, np.uint8) if data is not None else np.zeros(0, np.uint8)
    return _hashes(ends, text)


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _hashes(ends: NDArray[np.int32], text: NDArray[np.uint8]) -> NDArray[np.uint64]:
    hashes = np.empty(len(ends) - 1, np.uint64)
    for row in range(len(hashes)):
        value = _FNV_OFFSET
        for place in range(ends[row], ends[row + 1]):
            value = (value ^ np.uint64(text[place])) * _FNV_PRIME
        value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        hashes[row] = value ^ (value >> np.uint64(31))
    return hashes
