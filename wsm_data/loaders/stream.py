"""Batches of some steps, in order: read by threads, by worker processes, or by whoever asks for them."""

from collections.abc import Callable, Generator, Sequence
from itertools import chain, islice, repeat
from typing import TypeVar

from wsm_data.loaders.batch import PackedBatch
from wsm_data.loaders.config import ReadConfig, RemoteAccess
from wsm_data.loaders.plan import EpochPlan
from wsm_data.loaders.prefetch import Prefetch
from wsm_data.loaders.step_reader import StepReader
from wsm_data.loaders.timing import Part, Stopwatch, Timing
from wsm_data.loaders.worker_processes import StepDataset, read_in_processes

Delivered = TypeVar("Delivered")

BatchStream = Prefetch[Delivered] | Generator[Delivered, None, None]
"""Batches, or what is made of them, one after the other; `close` stops reading and waits until threads and processes
have ended."""

_CLIPS_AHEAD = 8192
"""Clips of all ranks whose shards a cache of shards is told of in advance. The lanes of a step come to new shards at
about the same time, so that many are needed at once: the downloads must begin some thousand clips earlier."""


def open_stream(
    reader: StepReader,
    transfer: Callable[[PackedBatch], Delivered],
    plan: EpochPlan,
    steps: Sequence[int],
    read: ReadConfig,
    timing: Timing,
    *,
    inline: bool,
) -> BatchStream[Delivered]:
    """Begin to read.

    Args:
        reader: reads a step.
        transfer: makes the batch of what was read, or more than that; called in the threads that read.
        plan: of the epoch.
        steps: what is read, in this order.
        read: threads, workers, and how far to read ahead.
        timing: adds up the time of all parts.
        inline: read in the caller's thread, whatever the settings say.
    """

    def finished(packed: PackedBatch) -> Delivered:
        watch = Stopwatch()
        with watch.measure(Part.TRANSFER):
            delivered = transfer(packed)
        timing.add(packed.seconds)
        timing.add(watch.seconds)
        return delivered

    announce = _announcer(reader, plan, steps, read)

    def read_step(step: int) -> Delivered:
        return finished(reader.read(plan, step))

    if read.workers and not inline:
        return _by_processes(StepDataset(reader, plan), steps, read, finished)
    if read.threads and not inline:
        return Prefetch(iter(steps), read_step, announce, threads=read.threads, depth=read.prefetch_batches)
    return _one_by_one(steps, read_step, announce)


def _announcer(reader: StepReader, plan: EpochPlan, steps: Sequence[int], read: ReadConfig) -> Callable[[int], None]:
    """What announces the next steps; it is called once for each step, before that is read."""
    upcoming = iter(steps)
    ahead = _CLIPS_AHEAD // plan.order.global_batch if read.access is RemoteAccess.SHARDS else 0
    counts = chain([1 + ahead], repeat(1))

    def announce(step: int) -> None:
        del step
        for later in islice(upcoming, next(counts)):
            reader.announce(plan, later)

    return announce


def _one_by_one(
    steps: Sequence[int], read_step: Callable[[int], Delivered], announce: Callable[[int], None]
) -> Generator[Delivered, None, None]:
    for step in steps:
        announce(step)
        yield read_step(step)


def _by_processes(
    dataset: StepDataset, steps: Sequence[int], read: ReadConfig, finished: Callable[[PackedBatch], Delivered]
) -> Generator[Delivered, None, None]:
    for packed in read_in_processes(dataset, steps, read):
        yield finished(packed)
