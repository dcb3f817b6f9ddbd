"""Stages one after the other in one run folder, and one table at the end."""

from collections.abc import Callable, Mapping
from pathlib import Path

import typer

from pipelines.registry import load_stage
from pipelines.running.engines.choice import Engine
from pipelines.running.given_up import OutputsNeeded
from pipelines.running.logs import log_table
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage_report import StageReport, summary_table


def run_in_order(
    configs: Mapping[str, object],
    run: Path,
    options_of: Callable[[str], RunOptions],
    engine: Engine,
    on_finished: Callable[[str], object] | None = None,
) -> None:
    """Run stages, each in the folder of its name, and print the table of all that came to their end.

    Where a stage needs outputs that were given up, the stage that makes them runs again, once.

    Args:
        configs: settings of the stages by their names, in the order of the flow.
        run: folder of the run.
        options_of: what is asked of a stage, by its name.
        engine: who runs the workers.
        on_finished: called with the name of each stage that came to its end.
    """
    names = list(configs)
    reports: dict[str, StageReport] = {}
    asked_back: set[str] = set()
    position = 0
    try:
        while position < len(names):
            name = names[position]
            try:
                reports[name] = run_stage(load_stage(name), configs[name], run / name, options_of(name), engine)
                if on_finished:
                    on_finished(name)
                position += 1
            except OutputsNeeded as needed:
                if needed.folder.parent != run.absolute() or needed.folder.name in asked_back:
                    raise
                asked_back.add(needed.folder.name)
                position = names.index(needed.folder.name)
    finally:
        if reports:  # also of a run that was stopped
            table = summary_table([reports[name] for name in names if name in reports])
            typer.echo(table)
            log_table(table)
