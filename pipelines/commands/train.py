"""`wsm train`: pretrain the model on releases."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.extras import require_extra
from pipelines.commands.options import Quiet


def train(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the run; it goes on from its last checkpoint.")],
    release: Annotated[
        str | None, typer.Argument(metavar="[RELEASE]", help="Release to train on, unless the settings name sources.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", "-c", help="TOML of differences to the defaults, or a packaged one: wsm5b_8x80gb."),
    ] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", "-s", help="One setting: section.key=value. Repeatable.")
    ] = None,
    init: Annotated[
        Path | None,
        typer.Option("--init", help="Start from these weights: a model's folder, a run's, or that of a checkpoint."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show settings, and memory, time and sizes by calculation; write nothing.")
    ] = False,
    anyway: Annotated[bool, typer.Option("--anyway", help="Of a dry run: do not refuse what cannot fit.")] = False,
    quiet: Quiet = False,
) -> None:
    """Train in a folder."""
    require_extra("train", ("safetensors", "tensorboard"))
    from pipelines.operations import train as operation

    operation.train(release, out, config, assignments or [], init, dry_run, anyway, quiet)


COMMAND = Command(
    name="train", summary="Pretrain the model; on several GPUs: torchrun -m pipelines.cli train ...", call=train
)
