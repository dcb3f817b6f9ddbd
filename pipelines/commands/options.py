"""Options and arguments that several commands take, each said once: a command names them as types of its parameters."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.running.engines.choice import EngineName

Release = Annotated[str, typer.Argument(metavar="RELEASE", help="Folder or URL of a release.")]
Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to write; what is done there is kept.")]
OutOfRelease = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="Folder to write; verify needs none, others take one named like the command."),
]
Config = Annotated[Path | None, typer.Option("--config", "-c", help="TOML of differences, with a section per stage.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", "-s", help="One setting: key=value or section.key=value. Repeatable."),
]
Workers = Annotated[int, typer.Option("--workers", "-w", min=0, help="Worker processes; 0: one a core.")]
Gpus = Annotated[
    int, typer.Option("--gpus", min=0, help="GPUs that encode for all workers; 0: each worker has its own codec.")
]
Engine = Annotated[EngineName, typer.Option("--engine", help="Where workers run: this machine, ray or Slurm.")]
Slurm = Annotated[
    list[str] | None,
    typer.Option("--slurm", help="With --engine slurm, what a job asks for: partition=gpu, time_min=120. Repeatable."),
]
UnitTimeout = Annotated[
    float,
    typer.Option(
        "--unit-timeout", min=0, help="Seconds in which a worker must settle a unit, or it hangs; 0: no limit."
    ),
]
Limit = Annotated[int, typer.Option("--limit", min=0, help="At most this many pending units; 0: all.")]
Only = Annotated[
    list[str] | None, typer.Option("--only", help="Only units whose id matches, as 'gibson_*/*'. Repeatable.")
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show settings and what would be done; write nothing.")]
MaxRefused = Annotated[
    float,
    typer.Option("--max-refused", min=0, help="Stop when more units are refused: share below 1, or number."),
]
Fork = Annotated[bool, typer.Option("--fork", help="With changed settings, write beside --out instead of stopping.")]
RetryRefused = Annotated[bool, typer.Option("--retry-refused", help="Try again what was refused before.")]
RetryReasons = Annotated[
    list[str] | None,
    typer.Option("--retry-reason", help="Try again what was refused for this reason code. Repeatable."),
]
Reclaim = Annotated[
    bool, typer.Option("--reclaim", help="Delete each clip of encode once its shard is written; not with --limit.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars, no line a unit.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="A line a unit in place of the bar, and more.")]
LogFile = Annotated[
    Path | None, typer.Option("--log-file", help="File to which a line a unit, warnings and tables are added.")
]
