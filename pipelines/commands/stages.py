"""One command for every stage, in the order of the flow; a stage with options of its own brings its command."""

from pipelines.commands import select, verify
from pipelines.commands.command import Command
from pipelines.commands.stage_options import filling, reading
from pipelines.registry import STAGES, StageEntry
from pipelines.running.options import StageRequest

_OWN_COMMANDS = {one.name: one for one in (verify.COMMAND, select.COMMAND)}


def _stage_command(entry: StageEntry) -> Command:
    def fill(request: StageRequest) -> None:
        _run(entry.name, request)

    def read(release: str, request: StageRequest) -> None:
        _run(entry.name, request, release)

    call = reading(read) if entry.reads_release else filling(fill)
    return Command(name=entry.name, summary=entry.summary, call=call)


def _run(name: str, request: StageRequest, release: str = "") -> None:
    from pipelines.operations.run_stage import run_one

    run_one(name, request, release)


COMMANDS = tuple(_OWN_COMMANDS.get(entry.name) or _stage_command(entry) for entry in STAGES)
