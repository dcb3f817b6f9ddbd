import os
import pickle
import signal
from dataclasses import replace
from itertools import islice

import pytest
import torch

from wsm_data.errors import IntegrityError
from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.reading.step_reader import StepReader
from wsm_data.loaders.reading.worker_processes import StepDataset, read_in_processes
from wsm_data.loaders.sources.clips import open_sources

pytestmark = pytest.mark.timeout(60)
READ = ReadConfig(workers=2, prefetch_batches=4)


@pytest.fixture
def dataset(released) -> StepDataset:
    sources = open_sources([SourceConfig(release=str(released.folder))])
    return StepDataset(StepReader(sources, READ, rank=0, world_size=1), sources.plan(OrderConfig(global_batch=4), 0))


class Spoilt(StepDataset):
    """Steps of which one fails, or kills the worker that reads it."""

    def __init__(self, dataset: StepDataset, step: int, *, kills: bool):
        self._dataset, self._step, self._kills = dataset, step, kills

    def __getitem__(self, step: int):
        if step == self._step and self._kills:
            os.kill(os.getpid(), signal.SIGKILL)
        if step == self._step:
            raise IntegrityError("train-000003.tar, clip a/b/c: the checksum is wrong")
        return self._dataset[step]


def test_steps_come_in_order_whichever_worker_reads_them(dataset):
    assert [packed.step for packed in read_in_processes(dataset, [4, 0, 3, 1], READ)] == [4, 0, 3, 1]


def test_what_workers_read_is_what_is_read_here(dataset):
    for packed in read_in_processes(dataset, range(3), READ):
        own = dataset[packed.step]
        assert packed.layout == own.layout
        assert packed.keys == own.keys
        for name, tensor in packed.tensors().items():
            assert torch.equal(tensor, own.tensors()[name]), name
        assert sum(packed.seconds.values()) > 0


def test_batches_and_readers_pickle(dataset):
    """A batch that did not would be dropped by torch without a word, and waited for without end."""
    packed = dataset[1]
    copy = pickle.loads(pickle.dumps(packed))  # noqa: S301
    assert (copy.layout, copy.keys, copy.epoch, copy.step) == (packed.layout, packed.keys, packed.epoch, packed.step)
    assert torch.equal(copy.block, packed.block)
    assert torch.equal(pickle.loads(pickle.dumps(dataset))[1].block, packed.block)  # noqa: S301


def test_workers_have_no_page_locked_memory(released, monkeypatch):
    """They would need the GPU, which a forked process must not touch; without one, page-locking raises."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    read = replace(READ, pin_memory=True, device="cuda")
    sources = open_sources([SourceConfig(release=str(released.folder))])
    plan = sources.plan(OrderConfig(global_batch=4), 0)
    dataset = StepDataset(StepReader(sources, read, rank=0, world_size=1), plan)
    monkeypatch.setattr(torch.cuda, "is_available", _must_not_be_asked)
    found = list(read_in_processes(dataset, range(2), read))
    assert [packed.step for packed in found] == [0, 1]
    assert {packed.tensors()["rgb"].dtype for packed in found} == {torch.float16}  # as stored: for the GPU


def _must_not_be_asked() -> bool:
    raise AssertionError("a process without the GPU looked for it")


def test_an_error_of_a_worker_comes_at_its_step_with_its_words(dataset):
    stream = read_in_processes(Spoilt(dataset, 2, kills=False), range(5), READ)
    assert [packed.step for packed in islice(stream, 2)] == [0, 1]
    with pytest.raises(IntegrityError, match=r"train-000003\.tar, clip a/b/c: the checksum is wrong"):
        next(stream)


def test_a_worker_that_dies_is_an_error_not_a_hang(dataset):
    stream = read_in_processes(Spoilt(dataset, 1, kills=True), range(5), READ)
    with pytest.raises(RuntimeError, match=r"(?i)worker.*(killed|exited unexpectedly)"):
        list(stream)


def test_workers_end_when_the_stream_is_closed(dataset):
    before = set(torch.multiprocessing.active_children())  # of other tests, about to end
    stream = read_in_processes(dataset, range(5), READ)
    next(stream)
    children = set(torch.multiprocessing.active_children()) - before
    assert len(children) == 2
    stream.close()
    for child in children:
        child.join(timeout=20)
        assert not child.is_alive()


def test_the_random_numbers_of_the_run_are_not_touched(dataset):
    torch.manual_seed(0)
    before = torch.get_rng_state()
    list(read_in_processes(dataset, range(2), READ))
    assert torch.equal(torch.get_rng_state(), before)
