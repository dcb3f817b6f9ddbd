"""Memory for batches that is used again and again, and never while anybody still looks at it.

Touching fresh memory costs more than reading a clip into it: the system clears every page and maps it. So the memory
of a batch goes back to a pool when the last tensor or array that looks at it is gone, and not before.
"""

import mmap
import weakref
from collections import deque
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import torch

from wsm_data.errors import ConfigError

_HUGE_PAGE_BYTES = 2 << 20
_ROUNDING_SHARE = 8
"""Sizes are rounded up to a multiple of an eighth of themselves, so that slightly longer batches find their memory."""

Memory = np.ndarray
"""A block of bytes; uint8 [size]."""


class BufferPool:
    """Hands out memory and takes it back on its own. Safe to be used by several threads.

    No lock is taken: memory comes back wherever the garbage collector happens to run.
    """

    def __init__(self, *, keep: int, pinned: bool = False):
        """Start without any memory.

        Args:
            keep: most blocks that are kept for later; what comes back beyond that is given to the system.
            pinned: page-locked memory, from which a GPU copies while the processor does other things.

        Raises:
            ConfigError: page-locked memory needs a GPU, and there is none.
        """
        if pinned and not torch.cuda.is_available():
            raise ConfigError("pin_memory needs a CUDA device, and torch finds none; leave it out")
        self._allocate: Callable[[int], Memory] = _pinned_memory if pinned else _page_memory
        self._free: deque[Memory] = deque(maxlen=keep)
        self._block_bytes = 0

    def take(self, size_bytes: int) -> torch.Tensor:
        """Memory of undefined content, which starts at the beginning of a page.

        Returns:
            uint8 [size_bytes]. When it, and all views of it, are gone, the memory may be handed out again.
        """
        self._block_bytes = max(self._block_bytes, _rounded(size_bytes))
        memory = self._reused(size_bytes)
        view = memory[:size_bytes].view()
        lent = np.frombuffer(memoryview(view), np.uint8)  # an array of its own: views of it keep it, not `memory`
        weakref.finalize(lent, self._give_back, memory).atexit = False
        return torch.from_numpy(lent)

    def _reused(self, size_bytes: int) -> Memory:
        while True:
            try:
                memory = self._free.pop()  # the last one that came back: what is still in the cache is fastest
            except IndexError:
                return self._allocate(self._block_bytes)
            if len(memory) >= size_bytes:
                return memory

    def _give_back(self, memory: Memory) -> None:
        if len(memory) == self._block_bytes:
            self._free.append(memory)


def _rounded(size_bytes: int) -> int:
    step = max(_HUGE_PAGE_BYTES, 1 << max(0, size_bytes // _ROUNDING_SHARE).bit_length())
    return max(1, -(-size_bytes // step)) * step


def _page_memory(size_bytes: int) -> Memory:
    """Whole pages, huge ones where the system has them: one page fault for 2 MB in place of 512."""
    memory = mmap.mmap(-1, size_bytes, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with suppress(OSError):  # a kernel without them has small pages
            memory.madvise(mmap.MADV_HUGEPAGE)
    return np.frombuffer(memory, np.uint8)


def _pinned_memory(size_bytes: int) -> Memory:
    return torch.empty(size_bytes, dtype=torch.uint8, pin_memory=True).numpy()
