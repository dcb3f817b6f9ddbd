"""`wsm view`: what a path is, and its pages on the loopback of this machine."""

import asyncio
import socket
from collections.abc import Mapping
from pathlib import Path

import typer
import uvicorn

from pipelines.artifacts.layout import release_folder
from pipelines.artifacts.source import indexed_source
from pipelines.operations.soundness.source_manifest import fitting_manifests
from pipelines.running.quarantine import QUARANTINE_FILE, read_quarantine
from pipelines.running.stage_status import read_stage_folders
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.files.json_values import to_json
from wsm_data.files.locations import is_url
from wsm_data.readers.manifest import load_dataset
from wsm_data.shards.names import MANIFEST_NAME
from wsm_data.view.browser.app import Shown, view_app
from wsm_data.view.browser.release_shelf import ReleaseShelf
from wsm_data.view.browser.source_shelf import SourceShelf

_LOOPBACK = "127.0.0.1"


def shown(location: str, beside: str, dataset: str, weights: str) -> Shown:
    """What the pages show of a release, of the folder of a run, or of a source.

    Args:
        location: path of one of them, or URL of a release.
        beside: another release; empty for none.
        dataset: manifest to read a source with; empty for the first that fits.
        weights: folder of the codec's weights; empty for a codec without.

    Raises:
        ConfigError: it is none of them, or `beside` is given and there is no release.
        IntegrityError: the release is damaged, or the run's quarantine.
    """
    path = Path(location)
    if not is_url(location) and not (path / MANIFEST_NAME).exists():
        if not path.is_dir():
            raise ConfigError(f"there is no folder {location}; give a release, a run or a source")
        if read_stage_folders(path):
            return _run(path, beside, weights)
        return _source(path, beside, dataset)
    shelf = _shelf(location, weights)
    return Shown(
        title=shelf.release.manifest.name,
        release=shelf,
        other=_shelf(beside, weights) if beside else None,
        refusals=shelf.release.quarantine if shelf.release.manifest.quarantine_sha256 else (),
    )


def serve_pages(pages: Shown, port: int) -> None:
    """Serve pages until Ctrl-C or SIGTERM.

    Args:
        pages: what is shown.
        port: port of the loopback; 0 for any that is free. The first line that is printed says which.

    Raises:
        ConfigError: the port cannot be had.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((_LOOPBACK, port))
            listening.listen()
        except OSError as error:
            raise ConfigError(
                f"--port must be free, and {port} is not ({error}); take another, or 0 for any"
            ) from error
        typer.echo(f"{pages.title}: http://{_LOOPBACK}:{listening.getsockname()[1]}/ (Ctrl-C ends it)")
        server = uvicorn.Server(uvicorn.Config(view_app(pages), log_level="warning", access_log=False, lifespan="off"))
        try:
            asyncio.run(server.serve(sockets=[listening]))
        except KeyboardInterrupt:  # SIGTERM, too
            typer.echo("stopped")


def _shelf(location: str, weights: str) -> ReleaseShelf:
    return ReleaseShelf(open_release(location), weights)


def _run(run: Path, beside: str, weights: str) -> Shown:
    """The release of a run where it is packed, its refusals as they stand, and the source where it still lies."""
    release = next((one for one in (release_folder(run / "pack"), release_folder(run)) if _is_release(one)), None)
    if release is None:
        _require_nothing_beside(beside)
    shelf = None if release is None else _shelf(str(release), weights)
    return Shown(
        title=str(run),
        release=shelf,
        other=_shelf(beside, weights) if beside else None,
        source=_source_of(run / "index"),
        refusals=_refusals(run) if shelf is None else shelf.release.quarantine,
    )


def _is_release(folder: Path) -> bool:
    return (folder / MANIFEST_NAME).exists()


def _refusals(run: Path) -> tuple[Mapping[str, object], ...]:
    """What the stages of a run refused until now."""
    return tuple(
        {**to_json(refusal), "stage": record.name}
        for folder, record in sorted(read_stage_folders(run).items())
        for refusal in read_quarantine(folder / QUARANTINE_FILE)
    )


def _source_of(index: Path) -> SourceShelf | None:
    """The source of a run; None where it is not indexed yet, or does not lie where it lay."""
    try:
        source = indexed_source(index)
        return SourceShelf(source.root, source.dataset)
    except ConfigError:
        return None


def _source(path: Path, beside: str, dataset: str) -> Shown:
    _require_nothing_beside(beside)
    manifest = load_dataset(dataset or fitting_manifests(path)[0])
    return Shown(title=str(path), source=SourceShelf(path, manifest))


def _require_nothing_beside(beside: str) -> None:
    if beside:
        raise ConfigError(f"--beside {beside} is for a release, and there is none to show it beside")
