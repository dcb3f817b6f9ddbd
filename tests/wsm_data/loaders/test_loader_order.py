"""Ordered ids of clips, compared in order: the same for every number of ranks and threads, and every resume."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from wsm_data.loaders.config import Arrangement, Remainder
from wsm_data.loaders.loader import ClipLoader

MakeLoader = Callable[..., ClipLoader]
WORLD_SIZES = (1, 2, 3, 4, 6)
ORDER = {"global_batch": 12, "seed": 5, "remainder": Remainder.REPEAT, "standardise": False, "dtype": "float16"}
JOINED = ORDER | {"global_batch": 6, "arrangement": Arrangement.JOIN, "row_latents": 7, "remainder": Remainder.PAD}
SHORT = ORDER | {"global_batch": 6, "remainder": Remainder.DROP}
EPOCHS = 2


def _content(batch) -> tuple[object, ...]:
    """Everything of a batch that must not depend on how it was read: order of the clips, and what stands in it."""
    sums = [float(getattr(batch, name).double().sum()) for name in ("rgb", "depth", "poses")]
    return batch.epoch, batch.step, batch.refs.tolist(), batch.spans, batch.keys, sums


def _world_sizes(settings: dict[str, object]) -> list[int]:
    return [size for size in WORLD_SIZES if settings["global_batch"] % size == 0]


def _run(loaders: Sequence[ClipLoader], states: list[dict[str, object]] | None = None) -> list[list[int]]:
    """Ordered refs of every global step, all ranks in lockstep; fills `states` with that of rank 0 before each step."""
    steps = []
    for _ in range(EPOCHS):
        iterators = [iter(loader) for loader in loaders]
        while True:
            if states is not None:
                states.append(loaders[0].state_dict())
            batches = [next(iterator, None) for iterator in iterators]
            if batches[0] is None:
                assert batches == [None] * len(batches)  # no rank has more steps than another
                break
            steps.append([ref for batch in batches for ref in batch.refs.tolist()])
    return steps


def _ranks(make_loader: MakeLoader, world_size: int, settings: dict[str, object]) -> list[ClipLoader]:
    return [make_loader(rank=rank, world_size=world_size, **settings) for rank in range(world_size)]


@pytest.mark.parametrize("settings", [ORDER, JOINED, SHORT], ids=["repeat", "join", "drop"])
def test_every_world_size_sees_the_same_clips_in_the_same_order(make_loader, settings):
    expected = _run(_ranks(make_loader, 1, settings | {"threads": 0}))
    assert len(expected) >= 2 * EPOCHS
    assert expected[: len(expected) // 2] != expected[len(expected) // 2 :]  # every epoch has an order of its own
    for world_size, threads in zip(_world_sizes(settings), itertools.cycle([1, 4, 0]), strict=False):
        reading = {"threads": threads, "prefetch_batches": 1 + world_size % 3}
        assert _run(_ranks(make_loader, world_size, settings | reading)) == expected


@pytest.mark.parametrize("threads", [0, 1, 4])
@pytest.mark.parametrize("prefetch_batches", [1, 2, 7])
def test_threads_and_prefetch_change_neither_order_nor_content(make_loader, threads, prefetch_batches):
    expected = [_content(batch) for batch in make_loader(**JOINED, threads=0, verify="never")]
    loader = make_loader(**JOINED, threads=threads, prefetch_batches=prefetch_batches)
    assert [_content(batch) for batch in loader] == expected


@pytest.mark.parametrize("settings", [ORDER, JOINED], ids=["repeat", "join"])
def test_a_run_resumes_at_every_step_on_any_other_world_size(make_loader, settings):
    states: list[dict[str, object]] = []
    expected = _run(_ranks(make_loader, 1, settings | {"threads": 1}), states)
    for number, world_size in zip(range(len(expected)), itertools.cycle(_world_sizes(settings)), strict=False):
        loaders = _ranks(make_loader, world_size, settings | {"threads": number % 3})
        epochs_before = number // (len(expected) // EPOCHS)
        state = states[number + epochs_before]  # one more state was taken at the end of each epoch
        for loader in loaders:
            loader.load_state_dict(state)
        assert _run(loaders)[: len(expected) - number] == expected[number:]


def test_an_interrupted_epoch_goes_on_with_fewer_ranks_and_again_with_more(make_loader):
    expected = _run(_ranks(make_loader, 1, SHORT | {"threads": 0}))
    found: list[list[int]] = []
    state = None
    for world_size in (2, 6, 3, 1):
        loaders = _ranks(make_loader, world_size, SHORT | {"threads": 1, "prefetch_batches": 3})
        for loader in loaders:
            if state is not None:
                loader.load_state_dict(state)
        batches = [next(iter(loader)) for loader in loaders]
        found.append([ref for batch in batches for ref in batch.refs.tolist()])
        states = [loader.state_dict() for loader in loaders]
        assert all(other == states[0] for other in states)
        state = states[0]
    assert found == expected[: len(found)]


@pytest.mark.slow
@pytest.mark.parametrize("settings", [ORDER, JOINED | {"global_batch": 12}], ids=["repeat", "join"])
@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize("world_size", WORLD_SIZES)
def test_all_combinations_resumed_at_every_step(make_loader, settings, threads, world_size):
    """Also on the next world size: the state of one is loaded by the other."""
    states: list[dict[str, object]] = []
    expected = _run(_ranks(make_loader, 1, settings | {"threads": 0}), states)
    following = WORLD_SIZES[(WORLD_SIZES.index(world_size) + 1) % len(WORLD_SIZES)]
    reading = {"threads": threads}
    assert _run(_ranks(make_loader, world_size, settings | reading)) == expected
    for number in range(len(expected)):
        state = states[number + number // (len(expected) // EPOCHS)]
        loaders = _ranks(make_loader, following, settings | reading)
        for loader in loaders:
            loader.load_state_dict(state)
        assert _run(loaders)[: len(expected) - number] == expected[number:]


def test_nothing_is_lost_or_twice_in_an_epoch(make_loader, released):
    loader = make_loader(**JOINED)
    seen = np.concatenate([batch.refs for batch in loader])
    assert sorted(seen.tolist()) == list(range(len(released.clips)))
