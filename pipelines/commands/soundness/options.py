"""Options of the commands that look for what is wrong with data."""

from pathlib import Path
from typing import Annotated

import typer

Source = Annotated[Path, typer.Argument(metavar="SOURCE", help="Root of the source.")]
Dataset = Annotated[str, typer.Option("--dataset", help="Manifest to read it with, name or TOML file; empty: guess.")]
AsJson = Annotated[bool, typer.Option("--json", help="All numbers and limits as JSON; also what --baseline reads.")]
Sarif = Annotated[Path | None, typer.Option("--sarif", help="File to write the findings to as SARIF 2.1.0.")]
Baseline = Annotated[
    Path | None, typer.Option("--baseline", help="What --json printed before: findings in it are known, and pass.")
]
Github = Annotated[
    bool,
    typer.Option("--github", envvar="GITHUB_ACTIONS", help="Annotations for GitHub's runner, on standard error."),
]
