"""`wsm publish`, `wsm fetch` and `wsm merge`."""

from collections.abc import Sequence
from pathlib import Path

import typer
from tqdm import tqdm

from pipelines.stages.verify import require_sound, require_sound_attached
from wsm_data.access.derived.merge import merge_releases
from wsm_data.access.release import open_release, read_manifest
from wsm_data.access.transfer.card import CARD_NAME, dataset_card
from wsm_data.access.transfer.config import PublishConfig
from wsm_data.access.transfer.croissant import CROISSANT_NAME, croissant
from wsm_data.access.transfer.fetch import fetch_release
from wsm_data.access.transfer.publish import publish_release
from wsm_data.curation.attached import attached_names
from wsm_data.errors import ConfigError
from wsm_data.files.locations import is_url
from wsm_data.files.stores import open_store


def publish(release: Path, url: str, config: PublishConfig, quiet: bool) -> None:
    """Put a release behind a URL, and say what was sent.

    Raises:
        ConfigError: there is no release, the URL is none, or another release is there.
        IntegrityError: the release is damaged.
        StoreError: the store refuses or fails.
    """
    if not is_url(url):
        raise ConfigError(
            f"a release is published to a URL, found the path {url}; copy the folder, or write file://..."
        )
    opened = open_release(release)
    total = sum(shard.bytes for shard in opened.manifest.shards)
    with tqdm(total=total, unit="B", unit_scale=True, desc="publish", disable=quiet, dynamic_ncols=True) as bar:
        about = {CARD_NAME: dataset_card(opened).encode(), CROISSANT_NAME: croissant(opened).encode()}
        moved = publish_release(release, url, config, about, bar.update)
    typer.echo(
        f"{url} holds {opened.manifest.name}, {len(opened)} clips: {moved.moved_files} of {moved.files} files were "
        f"sent ({moved.moved_bytes:,} bytes), the others were there"
    )


def fetch(url: str, folder: Path, threads: int, quiet: bool) -> None:
    """Bring a release into a folder, and say what came.

    Raises:
        ConfigError: there is no release at the URL, or the folder holds other things.
        IntegrityError: a file is damaged in the store.
        StoreError: the store refuses or fails.
    """
    total = sum(shard.bytes for shard in read_manifest(open_store(url)).shards)
    with tqdm(total=total, unit="B", unit_scale=True, desc="fetch", disable=quiet, dynamic_ncols=True) as bar:
        moved = fetch_release(url, folder, threads, bar.update)
    require_sound_attached(str(folder), attached_names(open_store(folder)))
    typer.echo(
        f"{folder} holds the release of {url}: {moved.moved_files} of {moved.files} files came "
        f"({moved.moved_bytes:,} bytes), the others were there; every file has the sha256 of the manifest"
    )


def merge(locations: Sequence[str], out: Path, name: str, shard_mib: int) -> None:
    """Make one release of several, verify it, and say what it holds.

    Raises:
        ConfigError: fewer than two are given, they do not fit together, or the folder holds something.
        IntegrityError: one of them is damaged.
    """
    if len(locations) < 2:
        raise ConfigError("`wsm merge` must be given two releases at least, found one")
    if out.exists() and any(out.iterdir()) and not any(out.glob("*.tar")):
        raise ConfigError(f"{out} must be empty, or hold what an earlier `wsm merge` left; use another --out")
    releases = [open_release(location) for location in locations]
    if any(str(out.resolve()) == str(Path(location).resolve()) for location in locations):
        raise ConfigError(f"{out} is one of the releases that are merged; use another --out")
    merge_releases(releases, out, name, shard_mib << 20)
    clips = require_sound(str(out), quiet=True)
    typer.echo(f"{out} holds {name}, {clips} clips of {len(releases)} releases, and is whole")
