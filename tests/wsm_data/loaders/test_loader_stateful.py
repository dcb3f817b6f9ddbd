"""The loader inside torchdata's StatefulDataLoader: any place, with and without worker processes."""

import itertools

import pytest
from torchdata.stateful_dataloader import StatefulDataLoader

from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig
from wsm_data.loaders.loader import ClipLoader

STEPS = 7


@pytest.fixture
def config(tiny):
    """Seven steps of one clip each."""
    return LoaderConfig(
        sources=(SourceConfig(release=str(tiny.folder), split=""),),
        order=OrderConfig(seed=6, global_batch=1, remainder=Remainder.PAD, block_clips=1),
        read=ReadConfig(threads=1, standardise=False),
    )


def stateful(config, workers, *, epoch=0, every=1):
    loader = ClipLoader(config)
    loader.set_epoch(epoch)
    return StatefulDataLoader(loader, batch_size=None, num_workers=workers, snapshot_every_n_steps=every)


def steps(batches):
    return [(batch.epoch, batch.step, batch.keys) for batch in batches]


@pytest.fixture
def expected(config):
    with ClipLoader(config) as loader:
        return [steps(loader) for _ in range(3)]


@pytest.mark.parametrize("workers", [0, 2])
def test_an_epoch_is_delivered_in_order(config, expected, workers):
    for epoch in range(2):
        assert steps(stateful(config, workers, epoch=epoch)) == expected[epoch]


@pytest.mark.parametrize("delivered", range(STEPS))
def test_a_state_goes_on_exactly(config, expected, delivered):
    loader = stateful(config, 0)
    iterator = iter(loader)
    assert steps(itertools.islice(iterator, delivered)) == expected[0][:delivered]
    state = loader.state_dict()
    again = stateful(config, 0)
    again.load_state_dict(state)
    assert steps(again) == expected[0][delivered:]
    assert steps(again) == expected[1]  # the dataset itself has moved on to the next epoch


@pytest.mark.parametrize(("delivered", "every"), [(1, 1), (4, 1), (5, 3), (6, 1)])
def test_a_state_goes_on_exactly_with_worker_processes(config, expected, delivered, every):
    """Every worker has a state of its own; what was read ahead and not delivered is delivered after the resume."""
    loader = stateful(config, 2, every=every)
    iterator = iter(loader)
    assert steps(itertools.islice(iterator, delivered)) == expected[0][:delivered]
    state = loader.state_dict()
    del iterator
    again = stateful(config, 2, every=every)
    again.load_state_dict(state)
    assert steps(again) == expected[0][delivered:]
