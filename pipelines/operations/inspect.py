"""`wsm inspect`: what is in a release, as text, and one clip as a picture or a recording."""

import json
from pathlib import Path

import typer

from wsm_data.access.release import Release, open_release
from wsm_data.errors import ConfigError
from wsm_data.files.json_values import to_json
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.release_codec import codec_of
from wsm_data.view.clip.contact_sheet import draw_contact_sheet
from wsm_data.view.clip.rerun_export import write_rerun
from wsm_data.view.clip.text import describe_clip
from wsm_data.view.release.text import describe_release


def inspect_release(
    location: str, key: str | None, out: Path | None, rerun: Path | None, limit: int, weights: str
) -> None:
    """Print a release and its first `limit` clips (0: all), or one clip, and write its contact sheet or recording.

    With `rerun` a recording is written there, and a contact sheet only where `out` asks for it.

    Raises:
        ConfigError: a file is asked for and no clip is named.
    """
    if key is None and (out or rerun):
        raise ConfigError("--out and --rerun show one clip: name it by its KEY after the release")
    release = open_release(location)
    if key is None:
        _list_clips(release, limit)
        return
    clip = release.read_clip(find_key(release, key))
    typer.echo(describe_clip(clip))
    codec = codec_of(release.manifest, weights)  # after the text, which needs no weights
    if rerun:
        write_rerun(clip, codec, rerun)
        typer.echo(f"recording: {rerun}")
    if out or not rerun:
        path = out or Path(f"{clip.meta.key.replace('/', '_')}.png")
        draw_contact_sheet(clip, codec, path)
        typer.echo(f"contact sheet: {path}")


def print_json(location: str, key: str | None, limit: int) -> None:
    """Print as JSON the manifest of a release and the keys of its first `limit` clips (0: all), or what one clip says.

    Raises:
        ConfigError: there is no such release or clip.
    """
    release = open_release(location)
    record: dict[str, object] = {"release_digest": release_digest(release.manifest)}
    if key is None:
        keys = sorted(release.index.texts("key"))
        record |= {"manifest": to_json(release.manifest), "clips": keys[:limit] if limit else keys}
    else:
        clip = release.read_clip(find_key(release, key))
        record |= {"meta": to_json(clip.meta), "shapes": {name: list(one.shape) for name, one in clip.arrays().items()}}
    typer.echo(json.dumps(record, indent=2))


def find_key(release: Release, text: str) -> str:
    """A clip's key, given as key or as the id of its trajectory; what is neither stays as it is."""
    if text in release.index.texts("key"):
        return text
    try:
        return EpisodeId.parse(text).key
    except ValueError:
        return text


def _list_clips(release: Release, limit: int) -> None:
    typer.echo(describe_release(release))
    keys = sorted(release.index.texts("key"))
    shown = keys[:limit] if limit else keys
    typer.echo("\nclips\n" + "\n".join(f"  {one}" for one in shown))
    if len(shown) < len(keys):
        typer.echo(f"  and {len(keys) - len(shown)} more; --limit 0 lists all")
