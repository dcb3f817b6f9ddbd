"""`wsm select`: choose clips, and on request show them on a page or copy them into a release of their own."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import typer

from pipelines.artifacts.layout import release_folder
from pipelines.commands.stages import run_built, stage_settings
from pipelines.stages import materialise as copying
from pipelines.stages import select, verify
from wsm_data.access.release import open_release
from wsm_data.shards.release_codec import codec_of
from wsm_data.view.selection.report import write_selection_report


def run_select(
    *,
    release: str,
    out: Path | None,
    config: Path | None,
    assignments: Sequence[str] | None,
    report: bool,
    materialise: Path | None,
    weights: str,
    **options: Any,
) -> None:
    """Write a selection to `out` and into its release.

    Args:
        release: folder or URL of the release.
        out: folder of the selection; without one, select/NAME.
        config: TOML file with a section `select`.
        assignments: `key=value` words.
        report: write NAME.html beside the selection.
        materialise: copy the clips into a release of their own below this folder, and verify it.
        weights: folder of the codec's weights, where it has any; for the pictures of the report.
        options: what to run now.

    Raises:
        ConfigError: a setting, an input or an option is wrong.
        IntegrityError: a clip that is shown or copied is damaged.
    """
    settings: select.SelectConfig = stage_settings("select", config, assignments, release)
    folder = run_built(select.STAGE, settings, out or Path("select") / settings.name, options)
    if options["dry_run"]:
        return
    path = folder / settings.file_name
    select.install_selection(path, settings)
    typer.echo(f"selection: {path}")
    if report:
        page = path.with_suffix(".html")
        opened = open_release(release)
        write_selection_report(opened, str(path), settings.scores_location, codec_of(opened.manifest, weights), page)
        typer.echo(f"report: {page}")
    if materialise:
        _materialise(release, path, materialise, options)


def _materialise(release: str, selection: Path, out: Path, options: Mapping[str, Any]) -> None:
    config = copying.MaterialiseConfig(release=release, selection=str(selection))
    folder = release_folder(run_built(copying.STAGE, config, out, options))
    clips = verify.require_sound(str(folder), options["quiet"])
    typer.echo(f"release: {folder}, {clips} clips, verified")
