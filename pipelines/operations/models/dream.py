"""`wsm dream`: what a model makes of one clip, beside the truth."""

from pathlib import Path

import typer

from pipelines.operations.models.dream_film import write_dream_film
from pipelines.operations.models.opened import open_model
from pipelines.training.config import HeldOutConfig
from pipelines.training.data import clip_batch
from pipelines.training.pictures import draw_dream, dream_clip
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_model.evaluation.streaming import dream_bounds


def dream(
    folder: Path,
    location: str,
    key: str,
    out: Path,
    config: HeldOutConfig,
    *,
    flow_shift: float,
    codec_weights: str,
) -> None:
    """Let a model see the first half of a clip and dream a chunk; draw both as training does, or film them.

    Args:
        folder: of the model.
        location: folder or URL of the release.
        key: of the clip, of any split.
        out: PNG or MP4 to write; replaced as a whole.
        config: chunk size, sampler steps, and how much of the clip is taken.
        flow_shift: gamma of the flow time.
        codec_weights: folder of the weights of the release's codec, where it has any.

    Raises:
        ConfigError: the file is no PNG or MP4, there is no model, release or clip, the model is of other
            latents, or the clip leaves nothing to dream.
        IntegrityError: the model or the clip is damaged.
    """
    if out.suffix not in (".png", ".mp4"):
        raise ConfigError(f"--out must name a PNG or an MP4, a file that ends in .png or .mp4, found {out}")
    release = open_release(location)
    opened = open_model(folder, release, codec_weights)
    batch = clip_batch(release, key, config, opened.device, depth=opened.needs_depth)
    latents = batch.spans[0].length
    seen, end = dream_bounds(latents, config.session.chunk_size)
    if seen == end:
        raise ConfigError(f"a clip must have a latent to see and one to dream, found {latents} in {key}")
    if out.suffix == ".mp4":
        dreamed = dream_clip(opened.model, batch, config, shift=flow_shift)
        write_dream_film(out, release.read_clip(key), batch, opened.decoding, dreamed)
    else:
        title = f"after step {opened.card.steps}"
        draw_dream(opened.model, batch, opened.decoding, config, out, shift=flow_shift, title=title)
    typer.echo(f"dream: {out}")
