"""Who holds a stage's folder, found without taking the lock."""

import os
import subprocess
import sys

import pytest

from pipelines.running.folder import locked
from pipelines.running.lock_holder import held_locks, lock_holder

visible = pytest.mark.skipif(held_locks() is None, reason="this system has no table of locks")
HOLDER = """
import sys
from pathlib import Path
from pipelines.running.folder import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    input()
"""


@visible
def test_the_holder_is_named_while_it_holds_and_nobody_afterwards(tmp_path):
    with locked(tmp_path):
        assert lock_holder(tmp_path, held_locks()) == os.getpid()
    assert lock_holder(tmp_path, held_locks()) is None


@visible
def test_a_killed_process_holds_nothing(tmp_path):
    text = (
        "import sys, pathlib, pipelines.running.folder as f\nwith f.locked(pathlib.Path(sys.argv[1])): print(), input()"
    )
    command = [sys.executable, "-c", text.replace("print()", "print(flush=True)"), str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        assert lock_holder(tmp_path, held_locks()) == process.pid
        process.kill()
    assert lock_holder(tmp_path, held_locks()) is None


def test_a_folder_that_was_never_locked_is_held_by_nobody_and_stays_as_it_is(tmp_path):
    assert lock_holder(tmp_path, {}) is None
    assert list(tmp_path.iterdir()) == []


def test_locks_of_other_kinds_and_those_who_wait_hold_nothing(tmp_path):
    table = tmp_path / "locks"
    table.write_text(
        "1: POSIX  ADVISORY  WRITE 11 fe:00:5 0 EOF\n"
        "2: FLOCK  ADVISORY  WRITE 12 fe:0a:6 0 EOF\n"
        "2: -> FLOCK  ADVISORY  WRITE 13 fe:0a:6 0 EOF\n"
    )
    assert held_locks(table) == {(0xFE, 0x0A, 6): 12}
    assert held_locks(tmp_path / "absent") is None
