import gc
import sys
import threading
import weakref

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.buffers import BufferPool, allocator

MIB = 1 << 20


def page_pool(*, blocks: int, **settings) -> BufferPool:
    return BufferPool(blocks=blocks, allocate=allocator(pinned=False), **settings)


class Watched:
    """Makes memory, and knows how much of it is still there."""

    def __init__(self):
        self._made = []

    def __call__(self, size_bytes: int) -> np.ndarray:
        memory = np.zeros(size_bytes, np.uint8)
        self._made.append(weakref.ref(memory))
        return memory

    @property
    def sizes(self) -> list[int]:
        return [len(memory) for made in self._made if (memory := made()) is not None]


def test_memory_is_used_again_when_nobody_looks_at_it():
    pool = page_pool(blocks=2)
    places = set()
    for _ in range(5):
        block = pool.take(3 * MIB)
        places.add(block.data_ptr())
        del block
    assert len(places) == 1


@pytest.mark.parametrize(
    "look",
    [
        lambda block: block[7:9],
        lambda block: block.view(torch.float32).view(2, -1)[1],
        lambda block: block.numpy(),
        lambda block: block.numpy()[100:200],
        lambda block: memoryview(block.numpy()),
        lambda block: block.as_strided((2, 2), (8, 1), 5),
    ],
    ids=["slice", "other dtype", "array", "slice of an array", "memoryview", "strided"],
)
def test_memory_that_somebody_looks_at_is_not_used_again(look):
    pool = page_pool(blocks=4)
    block = pool.take(MIB)
    block.fill_(7)
    view = look(block)
    place = block.data_ptr()
    del block
    other = pool.take(MIB)
    other.fill_(9)
    assert other.data_ptr() != place
    assert np.asarray(view).astype(np.float64).max() != 9
    del view
    assert pool.take(MIB).data_ptr() == place


def test_memory_starts_at_a_page_and_has_the_size_that_was_asked_for():
    block = page_pool(blocks=1).take(12345)
    assert block.data_ptr() % 4096 == 0
    assert (block.shape, block.dtype) == ((12345,), torch.uint8)


def test_memory_too_small_for_what_is_asked_is_let_go():
    watched = Watched()
    pool = BufferPool(blocks=3, allocate=watched)
    small = pool.take(MIB)
    large = pool.take(40 * MIB)
    del small, large
    assert pool.take(39 * MIB).numel() == 39 * MIB
    assert [size >= 40 * MIB for size in watched.sizes] == [True]


def test_no_more_is_kept_than_was_said():
    watched = Watched()
    pool = BufferPool(blocks=2, allocate=watched)
    held = [pool.take(MIB) for _ in range(6)]
    assert len(watched.sizes) == 6
    del held
    assert len(watched.sizes) == 2


def test_memory_that_comes_back_in_a_moment_is_waited_for():
    """A thread that reads ahead does not take more memory because it was faster than the caller."""
    pool = page_pool(blocks=1, patience_s=5.0)  # a busy machine may take long over a moment
    held = [pool.take(MIB)]
    place = held[0].data_ptr()
    timer = threading.Timer(2e-4, held.clear)
    timer.start()
    assert pool.take(MIB).data_ptr() == place
    timer.join()


@given(st.lists(st.tuples(st.integers(1, 9 * MIB), st.integers(0, 4)), min_size=1, max_size=25))
def test_what_is_held_is_never_overwritten(steps):
    """Any sequence of taking, holding and letting go; each block holds a number of its own to its end."""
    pool = page_pool(blocks=2)
    held: list[tuple[torch.Tensor, int]] = []
    for number, (size, letting_go) in enumerate(steps):
        block = pool.take(size)
        block[0], block[-1] = number, number
        held.append((block, number))
        del block
        for _ in range(min(letting_go, len(held))):
            held.pop(0)
        assert all(kept[0] == kept[-1] == content for kept, content in held)


def test_threads_never_share_a_block():
    pool = page_pool(blocks=3)
    clashes = []

    def work(number: int) -> None:
        for _ in range(200):
            block = pool.take(4096)
            block.fill_(number)
            if not (block == number).all():
                clashes.append(number)
            del block

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clashes == []


def test_blocks_outlive_their_pool():
    pool = page_pool(blocks=2)
    block = pool.take(MIB)
    block.fill_(5)
    del pool
    gc.collect()
    assert (block == 5).all()


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_page_locked_memory_needs_a_gpu():
    with pytest.raises(ConfigError, match="pin_memory needs a CUDA device"):
        allocator(pinned=True)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_page_locked_memory_is_used_again_too():
    pool = BufferPool(blocks=1, allocate=allocator(pinned=True))
    block = pool.take(MIB)
    place = block.data_ptr()
    assert block.is_pinned()
    del block
    assert pool.take(MIB).data_ptr() == place


@pytest.mark.timeout(60)
def test_nobody_waits_on_when_the_moment_ends_just_as_others_take_what_comes_back():
    """Several threads wait for a hair's breadth of time for one block that goes from hand to hand."""
    pool = BufferPool(blocks=1, allocate=Watched(), patience_s=2e-5)

    def take() -> None:
        for _ in range(2_000):
            pool.take(16)

    threads = [threading.Thread(target=take, daemon=True) for _ in range(3)]
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=120)
        assert not any(thread.is_alive() for thread in threads)
    finally:
        sys.setswitchinterval(interval_s)
