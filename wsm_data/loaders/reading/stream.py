"""Batches of some steps, in order: read by threads, by worker processes, or by whoever asks for them."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import chain, islice, repeat
from typing import Generic, TypeVar

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.batches.batch import PackedBatch
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.order.epoch_order import EpochOrder
from wsm_data.loaders.reading.prefetch import Prefetch, Work, done_alone
from wsm_data.loaders.reading.step_reader import StepReader, StepWork
from wsm_data.loaders.timing import Part, Stopwatch, Timing

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
    epoch_order: EpochOrder,
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
        epoch_order: which clips make up the steps.
        steps: what is read, in this order.
        read: threads, workers, and how far to read ahead.
        timing: adds up the time of all parts.
        inline: read in the caller's thread, whatever the settings say.
    """
    announce = _announcer(reader, epoch_order, steps, read)

    def begin(step: int) -> _BatchWork[Delivered]:
        return _BatchWork(reader.begin(epoch_order, step), transfer, timing)

    if read.threads and not inline:
        return Prefetch(iter(steps), begin, announce, threads=read.threads, depth=read.prefetch_batches)
    return _one_by_one(steps, begin, announce)


@dataclass(frozen=True)
class _BatchWork(Generic[Delivered]):
    """A batch in parts: its clips."""

    step: StepWork
    transfer: Callable[[PackedBatch], Delivered]
    timing: Timing

    @property
    def parts(self) -> int:
        return self.step.parts

    def make(self, part: int) -> None:
        self.step.make(part)

    def complete(self) -> Delivered:
        return _finished(self.transfer, self.timing, self.step.complete())


def _finished(transfer: Callable[[PackedBatch], Delivered], timing: Timing, packed: PackedBatch) -> Delivered:
    """Make of a batch what is delivered, and count the time of all its parts."""
    watch = Stopwatch()
    with watch.measure(Part.TRANSFER):
        delivered = transfer(packed)
    timing.add(packed.seconds)
    timing.add(watch.seconds)
    return delivered


def _announcer(
    reader: StepReader, epoch_order: EpochOrder, steps: Sequence[int], read: ReadConfig
) -> Callable[[int], None]:
    """What announces the next steps; it is called once for each step, before that is read."""
    upcoming = iter(steps)
    ahead = _CLIPS_AHEAD // epoch_order.config.global_batch if read.access is RemoteAccess.SHARDS else 0
    counts = chain([1 + ahead], repeat(1))

    def announce(step: int) -> None:
        del step
        for later in islice(upcoming, next(counts)):
            reader.announce(epoch_order, later)

    return announce


def _one_by_one(
    steps: Sequence[int], begin: Callable[[int], Work[Delivered]], announce: Callable[[int], None]
) -> Generator[Delivered, None, None]:
    for step in steps:
        announce(step)
        yield done_alone(begin(step))
