"""Ctrl-C and SIGTERM as exceptions that arrive, wherever the program is when they come."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

TERMINATED_EXIT_CODE = 128 + signal.SIGTERM
INTERRUPTED_EXIT_CODE = 128 + signal.SIGINT
_AGAIN_AFTER_S = 0.05


class Terminated(KeyboardInterrupt):
    """SIGTERM came: whoever ends in order at Ctrl-C does so here, too."""


@contextmanager
def arriving_interrupts() -> Iterator[None]:
    """Have SIGTERM raise `Terminated`, and raise that or KeyboardInterrupt again where it is swallowed.

    Python raises in whatever the main thread executes, also in a callback of a weak reference or in a `__del__`, out of
    which no exception comes: it is handed to `sys.unraisablehook`, and the program would go on.
    """
    swallowed: list[type[BaseException]] = []
    hook = sys.unraisablehook

    def raise_again_later(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            swallowed.append(unraisable.exc_type)
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_AFTER_S)  # raised here and now, it would be swallowed again
        else:
            hook(unraisable)

    def raise_again(_signal: int, _frame: FrameType | None) -> None:
        raise swallowed[-1]

    sys.unraisablehook = raise_again_later
    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, _terminate)}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, raise_again)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def termination_noted() -> Iterator[Callable[[], bool]]:
    """Let a program that asks end in order at SIGTERM; yields whether it came. A second one ends it at once."""
    noted: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        noted.append(number)
        signal.signal(signal.SIGTERM, _terminate)

    before = signal.signal(signal.SIGTERM, note)
    try:
        yield lambda: bool(noted)
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise Terminated
