"""Memory for batches that is used again and again, and never while anybody still looks at it.

Touching fresh memory costs more than reading a clip into it: the system clears every page and maps it. So the memory
of a batch goes back to a pool when the last tensor or array that looks at it is gone, and not before.
"""

import mmap
import threading
import time
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

PATIENCE_S = 2e-3
"""Who trains lets go of the last batch some microseconds after the next one is delivered."""

Memory = np.ndarray
"""A block of bytes; uint8 [size]."""

Allocate = Callable[[int], Memory]
"""Makes new memory of so many bytes, from the beginning of a page on."""


class BufferPool:
    """Hands out memory and takes it back on its own. Safe to be used by several threads.

    Memory comes back wherever the garbage collector happens to run, so nothing here waits for a lock then.
    """

    def __init__(self, *, blocks: int, allocate: Allocate, patience_s: float = PATIENCE_S):
        """Start without any memory.

        Args:
            blocks: blocks that are enough for who lets go of one batch when given the next. A further one is made only
                when none comes back within a moment, for those who keep batches, and not kept when it comes back.
            allocate: makes new memory (`allocator`).
            patience_s: how long that moment is, s.
        """
        self._allocate, self._patience_s = allocate, patience_s
        self._free: deque[Memory] = deque()  # may be filled while this thread is about to take from it
        self._came_back = threading.Lock()  # released when memory comes back, acquired by who waits for some
        self._blocks: set[int] = set()  # by id
        self._kept = self._enough = blocks
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
        # Not a SimpleQueue: in CPython 3.11, `get(timeout=...)` in several threads may wait without end.
        until_s = time.monotonic() + self._patience_s
        while True:
            try:
                memory = self._free.popleft()
            except IndexError:
                left_s = until_s - time.monotonic()
                if len(self._blocks) < self._enough or left_s <= 0:
                    return self._new()
                self._came_back.acquire(timeout=left_s)
                continue
            if len(memory) >= size_bytes:
                return memory
            self._blocks.discard(id(memory))

    def _new(self) -> Memory:
        if len(self._blocks) >= self._enough:
            self._enough *= 2  # somebody keeps batches: do not wait for each
        memory = self._allocate(self._block_bytes)
        self._blocks.add(id(memory))
        return memory

    def _give_back(self, memory: Memory) -> None:
        if len(memory) == self._block_bytes and len(self._blocks) <= self._kept:
            self._free.append(memory)
            with suppress(RuntimeError):  # it is released already
                self._came_back.release()
        else:
            self._blocks.discard(id(memory))
            self._enough = max(self._kept, len(self._blocks))  # they let go of it after all: wait again


def _rounded(size_bytes: int) -> int:
    step = max(_HUGE_PAGE_BYTES, 1 << max(0, size_bytes // _ROUNDING_SHARE).bit_length())
    return max(1, -(-size_bytes // step)) * step


def allocator(*, pinned: bool) -> Allocate:
    """What makes new memory.

    Args:
        pinned: page-locked, from which a GPU copies while the processor does other things.

    Raises:
        ConfigError: page-locked memory needs a GPU, and there is none.
    """
    if pinned and not torch.cuda.is_available():
        raise ConfigError("pin_memory needs a CUDA device, and torch finds none; leave it out")
    return _pinned_memory if pinned else _page_memory


def _page_memory(size_bytes: int) -> Memory:
    """Whole pages, huge ones where the system has them: one page fault for 2 MB in place of 512."""
    memory = mmap.mmap(-1, size_bytes, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with suppress(OSError):  # a kernel without them has small pages
            memory.madvise(mmap.MADV_HUGEPAGE)
    return np.frombuffer(memory, np.uint8)


def _pinned_memory(size_bytes: int) -> Memory:
    return torch.empty(size_bytes, dtype=torch.uint8, pin_memory=True).numpy()
