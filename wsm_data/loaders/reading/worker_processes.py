"""Steps read by worker processes of a torch DataLoader, in the same order as by threads.

Every batch crosses between processes through shared memory, which costs more than reading it: this is for those whose
training process has no time to spare.
"""

import os
from collections.abc import Iterable, Iterator
from typing import Any

import torch.utils.data

from wsm_data.loaders.batches.batch import PackedBatch
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.order.epoch_plan import EpochPlan
from wsm_data.loaders.reading.step_reader import StepReader


class StepDataset(torch.utils.data.Dataset[PackedBatch]):
    """The steps of an epoch by number; a process that got a copy of it opens the shards for itself.

    Such a process knows nothing of the steps that it will be asked for, so of a store each clip is asked for when its
    step is; and it has no page-locked memory.
    """

    def __init__(self, reader: StepReader, plan: EpochPlan):
        self._reader, self._plan = reader, plan
        self._process = os.getpid()

    def __getitem__(self, step: int) -> PackedBatch:
        if self._process != os.getpid():  # a fork takes neither threads nor connections along
            self._reader, self._process = self._reader.reopened(), os.getpid()
        self._reader.announce(self._plan, step)
        return self._reader.read(self._plan, step)


def read_in_processes(dataset: StepDataset, steps: Iterable[int], read: ReadConfig) -> Iterator[PackedBatch]:
    """Deliver steps in order, read by `read.workers` processes.

    An error in a worker is raised here, at its step. A worker that dies is a RuntimeError within seconds. The processes
    end when the iterator ends or is closed.
    """
    loader = torch.utils.data.DataLoader(
        dataset,
        batch_size=None,
        sampler=list(steps),
        num_workers=read.workers,
        prefetch_factor=max(1, -(-read.prefetch_batches // read.workers)),
        collate_fn=_unchanged,
        generator=torch.Generator(),  # its own: the random numbers of the training run are not touched
    )
    yield from loader


def _unchanged(packed: Any) -> Any:
    return packed
