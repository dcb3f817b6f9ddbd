"""A command of wsm in a process of its own, with so much memory and time and no more.

The processes are forked from a server that has loaded the command and has done nothing else: to start each afresh
would take longer than what it reads.
"""

import multiprocessing
import os
import resource
import sys
from pathlib import Path

LIMIT_BYTES = 6_000_000_000
LIMIT_S = 120

_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(  # a process has one such server: the workers of runs in it are forked from it too
    ["pipelines.warm_start", "pipelines.cli", "pipelines.operations.run_stage", "pipelines.stages.index"]
)


def limited(words: list[str], said: Path) -> int:
    """Exit code of `wsm WORDS`; what it says goes to a file.

    Raises:
        TimeoutError: it took longer than `LIMIT_S`; it is killed.
    """
    process = _SERVER.Process(target=_call, args=(words, said))
    process.start()
    process.join(LIMIT_S)
    if process.is_alive():
        process.kill()
        process.join()
        raise TimeoutError(said.read_text(errors="replace"))
    return process.exitcode


def _call(words: list[str], said: Path) -> None:
    from pipelines.cli import app

    resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
    file = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(file, stream)
    sys.argv = ["wsm", *words]
    app()
