"""Generator functions for the engines; worker processes import them by name."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from wsm_data.errors import DataError, Reason


def numbers_below(task: int) -> Iterator[tuple[int, int]]:
    for number in range(task):
        yield task, number


def process_id(_: object) -> Iterator[int]:
    time.sleep(0.05)
    yield os.getpid()


def parent_process_id(_: object) -> Iterator[int]:
    yield os.getppid()


def loaded_modules(_: object) -> Iterator[list[str]]:
    yield sorted(sys.modules)


def zeros(size: int) -> Iterator[bytes]:
    yield bytes(size)


def refuse(number: int) -> Iterator[int]:
    yield from range(2)
    raise DataError(Reason.FRAME_EMPTY, "seven is bad", {"number": 7})


def fail(number: int) -> Iterator[float]:
    yield 1.0
    yield number / 0


def fail_but_two(number: int) -> Iterator[float]:
    yield number
    if number != 2:
        yield number / 0


def die(_: object) -> Iterator[int]:
    yield 1
    os._exit(9)


def die_at_one(task: int) -> Iterator[int]:
    yield task
    if task == 1:
        os._exit(9)


def die_once(mark: str) -> Iterator[tuple[str, int]]:
    """Two results; the process dies between them the first time."""
    yield mark, 0
    if not Path(mark).exists():
        Path(mark).touch()
        time.sleep(0.2)  # what was given has left the process
        os._exit(9)
    yield mark, 1


def hang_once(mark: str) -> Iterator[str]:
    if not Path(mark).exists():
        Path(mark).touch()
        time.sleep(600)
    yield mark


def fail_to_pickle(_: object) -> Iterator[object]:
    yield lambda: None


def wait_and_touch(mark: str) -> Iterator[str]:
    Path(mark).write_text(str(os.getpid()))
    time.sleep(600)
    yield mark
