import types

import pytest

from wsm_data.loaders.batches.transfer import open_transfer
from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.reading.delivery import deliver
from wsm_data.loaders.reading.prefetch import Prefetch
from wsm_data.loaders.reading.step_reader import StepReader
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.timing import Part, Timing


@pytest.fixture
def delivery_of(released):
    sources = open_sources([SourceConfig(release=str(released.folder))])
    epoch_order = sources.order_epoch(OrderConfig(global_batch=4), 0)

    def make(steps, *, inline=False, timing=None, **reading):
        read = ReadConfig(**reading)
        reader = StepReader(sources, read, timing or Timing(), rank=0, world_size=1)
        transfer = open_transfer(read, released.release.manifest)
        return deliver(reader, transfer, epoch_order, steps, read, inline=inline)

    return make


@pytest.mark.parametrize("reading", [{"threads": 0}, {"threads": 2}, {"threads": 2, "inline": True}])
def test_the_steps_come_as_asked_and_their_time_is_counted(delivery_of, reading):
    timing = Timing()
    assert [batch.step for batch in delivery_of([3, 0, 2], timing=timing, **reading)] == [3, 0, 2]
    seconds = timing.seconds()
    assert min(seconds[part] for part in (Part.STORE, Part.CHECKSUM, Part.COLLATE)) > 0


def test_threads_read_ahead_where_there_are_some_and_it_is_not_to_be_inline(delivery_of):
    assert isinstance(delivery_of([0], threads=2), Prefetch)
    for delivery in (delivery_of([0], threads=2, inline=True), delivery_of([0], threads=0)):
        assert isinstance(delivery, types.GeneratorType)


def test_a_closed_delivery_gives_nothing_more(delivery_of):
    for reading in ({"threads": 0}, {"threads": 2}):
        delivery = delivery_of([0, 1, 2, 3], **reading)
        assert next(delivery).step == 0
        delivery.close()
        assert next(delivery, None) is None
