"""`wsm select`: choose clips, and on request show them on a page or copy them into a release of their own."""

from pathlib import Path

import typer

from pipelines.artifacts.layout import release_folder
from pipelines.artifacts.release_files import warn_if_not_writable
from pipelines.operations import materialise as copying
from pipelines.operations.run_stage import run_built, stage_settings
from pipelines.running.options import StageRequest
from pipelines.running.upstream import done_outcomes, vouched_by_ledger
from pipelines.stages import select, verify
from wsm_data.access.release import open_release
from wsm_data.shards.release_codec import codec_of
from wsm_data.shards.selection import selection_path
from wsm_data.view.selection.report import write_selection_report


def run_select(release: str, request: StageRequest, *, report: bool, materialise: Path | None, weights: str) -> None:
    """Write a selection to the folder that is asked for, or select/NAME, and into its release.

    Args:
        release: folder or URL of the release.
        request: what is asked of the stage.
        report: write NAME.html beside the selection.
        materialise: copy the clips into a release of their own below this folder, and verify it.
        weights: folder of the codec's weights, where it has any; for the pictures of the report.

    Raises:
        ConfigError: a setting, an input or an option is wrong.
        IntegrityError: a clip that is shown or copied is damaged.
    """
    settings = stage_settings(select.STAGE, request, release)
    warn_if_not_writable(release, selection_path(settings.name), "name the selection to loaders by its path")
    folder = run_built(select.STAGE, settings, request.out or Path("select") / settings.name, request)
    if request.options.dry_run:
        return
    path = vouched_by_ledger(folder, done_outcomes(folder)[select.UNIT], folder / settings.file_name)
    select.install_selection(path, settings)
    typer.echo(f"selection: {path}")
    if report:
        page = path.with_suffix(".html")
        opened = open_release(release)
        write_selection_report(opened, str(path), settings.scores_location, codec_of(opened.manifest, weights), page)
        typer.echo(f"report: {page}")
    if materialise:
        _materialise(release, path, materialise, request)


def _materialise(release: str, selection: Path, out: Path, request: StageRequest) -> None:
    config = copying.MaterialiseConfig(release=release, selection=str(selection))
    folder = release_folder(run_built(copying.STAGE, config, out, request))
    clips = verify.require_sound(str(folder), request.options.quiet)
    typer.echo(f"release: {folder}, {clips} clips, verified")
