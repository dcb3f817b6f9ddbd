"""Ctrl-C and SIGTERM end a program wherever they meet it."""

import os
import signal
import subprocess
import sys
import time
import weakref

import pytest

from pipelines.running.interrupts import Terminated, arriving_interrupts, termination_noted


class Watched:
    """Something that a weak reference can be made to."""


def end_me(*_):
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(100):  # Python raises between two of these, inside of the callback
        pass


def go_on():
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.01)
    raise AssertionError("the interrupt never arrived")


def with_a_callback():
    watched = Watched()
    reference = weakref.ref(watched, end_me)
    del watched
    assert reference() is None
    go_on()


def with_the_end_of_an_object():
    class Ending:
        __del__ = end_me

    Ending()
    go_on()


@pytest.mark.parametrize("program", [with_a_callback, with_the_end_of_an_object])
def test_ctrl_c_that_python_swallows_arrives_all_the_same(program):
    with pytest.raises(KeyboardInterrupt), arriving_interrupts():
        program()


def test_sigterm_is_an_exception_that_closes_what_is_open():
    closed = []

    def program():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            go_on()
        finally:
            closed.append("engine")

    with pytest.raises(Terminated), arriving_interrupts():
        program()
    assert closed == ["engine"]


def test_whoever_asks_for_sigterm_is_told_once_and_a_second_one_ends_it():
    with arriving_interrupts(), termination_noted() as noted:
        assert not noted()
        os.kill(os.getpid(), signal.SIGTERM)
        assert noted()
        with pytest.raises(Terminated):
            os.kill(os.getpid(), signal.SIGTERM)


def test_everything_is_as_before_at_the_end():
    numbers = (signal.SIGTERM, signal.SIGALRM, signal.SIGINT)
    before = [signal.getsignal(number) for number in numbers], sys.unraisablehook
    with arriving_interrupts(), termination_noted():
        pass
    assert ([signal.getsignal(number) for number in numbers], sys.unraisablehook) == before


def test_what_else_is_raised_there_is_still_told_and_ends_nothing():
    program = (
        "from pipelines.running.interrupts import arriving_interrupts\n"
        "class Ending:\n"
        "    def __del__(self): raise ValueError('told')\n"
        "with arriving_interrupts():\n"
        "    Ending()\n"
        "print('went on')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "went on\n"
    assert "ValueError: told" in done.stderr
