"""`wsm export tum`: clips of a release as sequences of TUM's RGB-D benchmark."""

from pathlib import Path

import typer

from wsm_data.access.release import open_release
from wsm_data.clips.tum_sequence import write_tum_sequence


def export_tum(location: str, out: Path, split: str, limit: int, weights: str) -> None:
    """Write the first `limit` clips (0: all) of a split, in the order of the index, each to a folder below `out`.

    A folder is named as the key of its clip with dots between its parts; keys themselves have no dot.

    Raises:
        ConfigError: there is no such release or split, or its codec cannot be built.
    """
    release = open_release(location)
    keys = release.keys(split=split)
    chosen = keys[:limit] if limit else keys
    for key in chosen:
        clip = release.read_clip(key)
        frames = range(clip.frame_count - clip.meta.padded_frames)
        decoded = release.decode(clip, frames=frames, weights=weights)
        write_tum_sequence(out / key.replace("/", "."), clip, decoded)
    typer.echo(f"{len(chosen)} of {len(keys)} clips: {out}")
