"""`wsm inspect`: what is in a release, as text, and one clip as a picture."""

from pathlib import Path

import typer

from pipelines.release_codec import codec_of
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.release import Release, open_release
from wsm_data.view.clip_text import describe_clip
from wsm_data.view.contact_sheet import draw_contact_sheet
from wsm_data.view.release_text import describe_release


def inspect_release(location: str, key: str | None, out: Path | None, limit: int, weights: str) -> None:
    """Print a release and its first `limit` clips (0: all), or one clip, and write its contact sheet."""
    release = open_release(location)
    if key is None:
        typer.echo(describe_release(release))
        keys = sorted(release.index.texts("key"))
        shown = keys[:limit] if limit else keys
        typer.echo("\nclips\n" + "\n".join(f"  {one}" for one in shown))
        if len(shown) < len(keys):
            typer.echo(f"  and {len(keys) - len(shown)} more; --limit 0 lists all")
        return
    clip = release.read_clip(_key(release, key))
    typer.echo(describe_clip(clip))
    path = out or Path(f"{clip.meta.key.replace('/', '_')}.png")
    draw_contact_sheet(clip, codec_of(release.manifest, weights), path)
    typer.echo(f"contact sheet: {path}")


def _key(release: Release, text: str) -> str:
    """A clip's key, given as key or as the id of its trajectory."""
    keys = set(release.index.texts("key"))
    if text not in keys and text.count("/") == 2:
        return EpisodeId.parse(text).key
    return text
