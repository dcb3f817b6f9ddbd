"""`wsm film`: one clip of a release as an MP4."""

from pathlib import Path

import typer

from pipelines.operations.inspect import find_key
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.view.navigation.clip_film import write_clip_film


def film_clip(location: str, key: str, out: Path, weights: str) -> None:
    """Write the film of one clip and say where it is.

    Raises:
        ConfigError: `out` does not end in .mp4, the release has no such clip, or its codec cannot be built.
    """
    if out.suffix != ".mp4":
        raise ConfigError(f"--out must name an MP4, a file that ends in .mp4, found {out}")
    release = open_release(location)
    count = write_clip_film(release.read_clip(find_key(release, key)), release.codec(weights), out)
    typer.echo(f"film: {out}, {count} frames")
