"""`wsm export tum`: clips of a release as sequences of TUM's RGB-D benchmark."""

from pathlib import Path

import typer

from wsm_data.access.release import Release, open_release
from wsm_data.clips.tum_sequence import write_tum_sequence
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.jsonlines import canonical_json

_RELEASE_FILE = "release.json"
"""Says in the folder whose sequences it holds."""


def export_tum(location: str, out: Path, split: str, limit: int, weights: str) -> None:
    """Write the first `limit` clips (0: all) of a split, in the order of the index, each to a folder below `out`.

    A folder is named as the key of its clip with dots between its parts; keys themselves have no dot.

    Raises:
        ConfigError: there is no such release or split, its codec cannot be built, or `out` holds something else than
            sequences of this release.
    """
    release = open_release(location)
    keys = release.keys(split=split)
    chosen = keys[:limit] if limit else keys
    _claim(out, release)
    for key in chosen:
        clip = release.read_clip(key)
        frames = range(clip.meta.recorded_frames)
        decoded = release.decode(clip, frames=frames, weights=weights)
        write_tum_sequence(out / key.replace("/", "."), clip, decoded)
    typer.echo(f"{len(chosen)} of {len(keys)} clips: {out}")


def _claim(out: Path, release: Release) -> None:
    """Write down whose sequences these are: pictures of another release would stay among them, in no list."""
    path = out / _RELEASE_FILE
    said = canonical_json({"name": release.manifest.name, "release": release.digest}) + "\n"
    if out.is_dir() and any(out.iterdir()) and not (path.is_file() and path.read_text() == said):
        raise ConfigError(
            f"{out} must be empty, or hold sequences of the release {release.digest} alone, as {path} says, and does "
            "not; use another --out"
        )
    write_text(path, said)
