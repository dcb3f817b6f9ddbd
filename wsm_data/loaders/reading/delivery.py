"""Steps read and delivered in order: by threads that read ahead, or by whoever asks for them."""

from collections.abc import Callable, Generator, Sequence
from itertools import chain, islice, repeat

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.batches.batch import BatchBlock
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.order.epoch_order import EpochOrder
from wsm_data.loaders.reading.prefetch import Prefetch, Work, done_alone
from wsm_data.loaders.reading.step_reader import Delivered, StepReader

Delivery = Prefetch[Delivered] | Generator[Delivered, None, None]
"""What is delivered, one step after the other; `close` stops reading and waits until threads have ended."""

_CLIPS_AHEAD = 8192
"""Clips of all ranks whose shards a cache of shards is told of in advance. The lanes of a step come to new shards at
about the same time, so that many are needed at once: the downloads must begin some thousand clips earlier."""


def deliver(
    reader: StepReader,
    finish: Callable[[BatchBlock], Delivered],
    epoch_order: EpochOrder,
    steps: Sequence[int],
    read: ReadConfig,
    *,
    inline: bool,
) -> Delivery[Delivered]:
    """Begin to read.

    Args:
        reader: reads a step.
        finish: makes of a batch what is delivered; called in the threads that read.
        epoch_order: which clips make up the steps.
        steps: what is read, in this order.
        read: how many threads read, and how far ahead.
        inline: read in the caller's thread, whatever the settings say.
    """
    announce = _announcer(reader, epoch_order, steps, read)

    def begin(step: int) -> Work[Delivered]:
        return reader.begin(epoch_order, step, finish)

    if read.threads and not inline:
        return Prefetch(iter(steps), begin, announce, threads=read.threads, depth=read.prefetch_batches)
    return _one_by_one(steps, begin, announce)


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
