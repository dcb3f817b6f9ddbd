"""`wsm publish`, `wsm fetch` and `wsm merge`: releases as wholes."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Quiet
from wsm_data.access.transfer.config import PublishConfig

_DEFAULT = PublishConfig()
_URL = "URL of a folder, as s3://bucket/release or hf://datasets/somebody/release."


def publish(
    release: Annotated[Path, typer.Argument(metavar="RELEASE", help="Folder of a release.")],
    url: Annotated[str, typer.Argument(metavar="URL", help=_URL)],
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite another release at the URL.")] = False,
    threads: Annotated[
        int, typer.Option("--threads", min=1, help="Files that are uploaded at a time.")
    ] = _DEFAULT.threads,
    part_mib: Annotated[
        int,
        typer.Option("--part-mib", min=5, help="Size of the parts in which S3 gets a file, MiB; a thread holds one."),
    ] = _DEFAULT.part_mib,
    quiet: Quiet = False,
) -> None:
    """Put a release behind a URL."""
    from pipelines.operations.stores import publish as work

    work(release, url, PublishConfig(threads=threads, part_mib=part_mib, replace=replace), quiet)


def fetch(
    url: Annotated[str, typer.Argument(metavar="URL", help=_URL)],
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write; what is there already is kept.")],
    threads: Annotated[int, typer.Option("--threads", min=1, help="Requests at a time.")] = _DEFAULT.threads,
    quiet: Quiet = False,
) -> None:
    """Bring a release into a folder."""
    from pipelines.operations.stores import fetch as work

    work(url, folder, threads, quiet)


def merge(
    releases: Annotated[list[str], typer.Argument(metavar="A B ...", help="Folders or URLs of releases.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the new release.")],
    name: Annotated[str, typer.Option("--name", help="Name of the new release.")] = "release",
    shard_mib: Annotated[int, typer.Option("--shard-mib", min=1, help="Shards are filled up to this size, MiB.")] = 512,
) -> None:
    """Merge releases."""
    from pipelines.operations.stores import merge as work

    work(releases, out, name, shard_mib)


MERGE_COMMAND = Command(name="merge", summary="Make one release of several, verified, with their digests.", call=merge)
PUBLISH_COMMAND = Command(name="publish", summary="Put a release behind a URL, compared and resumable.", call=publish)
FETCH_COMMAND = Command(
    name="fetch", summary="Bring a published release into a folder, compared and resumable.", call=fetch
)
