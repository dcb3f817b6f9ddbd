"""`wsm run --out URL`: stages work in a folder of this machine, and what each of them finishes goes behind the URL."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import typer

from pipelines.operations.run_recipe import run_recipe
from pipelines.recipe import load_recipe
from pipelines.running.folder import STAGE_FILE
from pipelines.running.options import StageRequest
from pipelines.running.settings import parse_assignments
from wsm_data.errors import ConfigError
from wsm_data.files.uploads.mirror import bring_folder, send_folder
from wsm_data.files.uploads.target import open_target
from wsm_data.shards.names import MANIFEST_NAME

_LAST = (MANIFEST_NAME, STAGE_FILE)
"""Whoever sees one of them takes what stands beside it for whole."""


def run_at_url(recipe: str, request: StageRequest, url: str, work: Path | None) -> None:
    """Run a recipe whose folders are kept behind a URL.

    A stage that was begun in the work folder goes on there. Of one that was not, what another machine finished is
    brought first. One machine at a time may work on a URL: nothing locks it.

    Args:
        recipe: name or path of the recipe.
        request: what is asked.
        url: where the run is kept.
        work: folder on this machine.

    Raises:
        ConfigError: there is no work folder, nothing can be kept at the URL, or as `run_recipe`.
        StoreError: the store refuses or fails.
    """
    if work is None:
        raise ConfigError(f"--out {url} needs a folder on this machine for the stages to work in: add --work FOLDER")
    if request.options.fork:
        raise ConfigError("--fork writes beside the folder; with a URL, give another --out and another --work")
    url = url.rstrip("/")
    open_target(url)
    here = replace(request, out=work)
    if not request.options.dry_run:
        _bring(load_recipe(recipe, request.config, parse_assignments(request.assignments)).stages, url, work)
    run_recipe(recipe, here, on_finished=lambda name: _send(name, url, work))


def _bring(stages: Sequence[str], url: str, work: Path) -> None:
    for name in stages:
        if not (work / name / STAGE_FILE).exists() and (files := bring_folder(f"{url}/{name}", work / name)):
            typer.echo(f"{name}: files brought from {url}/{name}: {files}")


def _send(name: str, url: str, work: Path) -> None:
    sent = send_folder(work / name, f"{url}/{name}", _LAST)
    typer.echo(f"{name}: files sent to {url}/{name}: {sent}")
