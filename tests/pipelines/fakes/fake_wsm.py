"""`wsm` with the fake stages in place of the real ones: as `python -m fake_wsm`, or a server of such commands."""

import json
import os
import sys
from collections.abc import Callable
from typing import Any

import fake_stages

from pipelines import registry


def use_fake_stages() -> None:
    """Put the fake stages where the registry's readers find them; before the first import of `pipelines.recipe`."""
    registry.STAGES = tuple(
        registry.StageEntry(name=stage.name, summary=f"Fake {stage.name}.")
        for stage in (fake_stages.COPY, fake_stages.JOIN)
    )
    modules = {"copy": fake_stages.CopyModule, "join": fake_stages.JoinModule}
    registry.load_stage_module = modules.__getitem__


def serve(app: Callable[..., Any]) -> None:
    """Answer each line of a folder and words with the exit code of the command there, in a process of its own.

    The process is forked from this one, where everything is imported; what it prints is in `stdout` and `stderr` there.
    """
    import pipelines.operations.run_stage  # noqa: F401 - what every command of a stage loads

    for line in sys.stdin:
        folder, *words = json.loads(line)
        child = os.fork()
        if not child:
            os.chdir(folder)
            for descriptor, name in ((1, "stdout"), (2, "stderr")):
                os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), descriptor)
            app(words, prog_name="wsm")
        sys.stdout.write(f"{os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    use_fake_stages()
    from pipelines.cli import app

    serve(app) if sys.argv[1:] == ["--serve"] else app(prog_name="wsm")
