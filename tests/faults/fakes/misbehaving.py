"""The fake stage `copy` with workers that are killed, hang or run out of memory at the unit a2, the first time."""

import os
import resource
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from fake_stages import COPY, CopyConfig, copy

from pipelines.running.stage import Outcome, StageContext, Unit


def _be_killed() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _hang() -> None:
    time.sleep(600)


def _eat_memory() -> None:
    limits = resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as file:  # noqa: PTH123 - no file of a folder
        size = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + (64 << 20), limits[1]))
    try:
        bytearray(1 << 30)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def _once(
    misbehave: Callable[[], None], batch: Sequence[Unit], config: CopyConfig, context: StageContext
) -> Iterator[Outcome]:
    for unit in batch:
        mark = config.source.parent / "misbehaved"
        if unit.id == "a2" and not mark.exists():
            mark.touch()
            misbehave()
        yield from copy([unit], config, context)


def killed(batch: Sequence[Unit], config: CopyConfig, context: StageContext) -> Iterator[Outcome]:
    return _once(_be_killed, batch, config, context)


def hanging(batch: Sequence[Unit], config: CopyConfig, context: StageContext) -> Iterator[Outcome]:
    return _once(_hang, batch, config, context)


def eating(batch: Sequence[Unit], config: CopyConfig, context: StageContext) -> Iterator[Outcome]:
    return _once(_eat_memory, batch, config, context)


KILLED, HANGING, EATING = (replace(COPY, process=one) for one in (killed, hanging, eating))
