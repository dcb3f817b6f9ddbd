"""How far ahead the readers are told of what is needed."""

from types import SimpleNamespace

import pytest

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.reading.delivery import deliver


class Recorder:
    """Stands in for a reader of steps: writes down what it is told."""

    def __init__(self):
        self.told = []

    def announce(self, epoch_order, step):
        self.told.append(("announced", step))

    def begin(self, epoch_order, step, finish):
        self.told.append(("read", step))
        return SimpleNamespace(parts=0, complete=lambda: finish(step))


def run(steps, **settings):
    recorder = Recorder()
    epoch_order = SimpleNamespace(config=SimpleNamespace(global_batch=4096))
    read = ReadConfig(threads=0, **settings)
    list(deliver(recorder, lambda step: step, epoch_order, steps, read, inline=False))
    return recorder.told


@pytest.mark.parametrize("steps", [range(6), range(3, 30, 4), range(1), range(0)], ids=str)
@pytest.mark.parametrize("access", list(RemoteAccess))
def test_every_step_is_announced_once_in_order_and_before_it_is_read(steps, access):
    told = run(steps, access=access)
    assert [step for what, step in told if what == "announced"] == list(steps)
    assert [step for what, step in told if what == "read"] == list(steps)
    assert all(told.index(("announced", step)) < told.index(("read", step)) for step in steps)


def test_whole_shards_are_announced_thousands_of_clips_ahead():
    told = run(range(10), access=RemoteAccess.SHARDS)
    before_the_first = told[: told.index(("read", 0))]
    assert [step for _, step in before_the_first] == [0, 1, 2]  # 8192 clips beyond the first step, 4096 a step
