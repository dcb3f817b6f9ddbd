"""`wsm eval clips`: what `wsm train` measures at its end, of any model on any release of its latents."""

import json
from pathlib import Path

import typer

from pipelines.operations.models.opened import open_model
from pipelines.running.settings import config_json
from pipelines.training.config import HeldOutConfig
from pipelines.training.data import clips_loader
from pipelines.training.evaluation import evaluate
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text


def eval_clips(
    folder: Path,
    location: str,
    out: Path,
    config: HeldOutConfig,
    *,
    seed: int,
    flow_shift: float,
    codec_weights: str,
    quiet: bool,
) -> None:
    """Measure a model, write evaluation.json and what it was made from (run.json), and print the means.

    Args:
        folder: of the model.
        location: folder or URL of the release.
        out: folder to write.
        config: which clips, how many, and how states are estimated.
        seed: of the order in which clips are taken; 0 is that of `wsm train`.
        flow_shift: gamma of the flow time.
        codec_weights: folder of the weights of the release's codec, where it has any.
        quiet: no progress bar.

    Raises:
        ConfigError: there is no model, release or split, no clip is asked for, or the model is of other latents.
        IntegrityError: the model or the release is damaged.
    """
    if not config.clips:
        raise ConfigError("clips must be at least 1, found 0: without a clip there is nothing to measure")
    release = open_release(location)
    opened = open_model(folder, release, codec_weights)
    path = out / "evaluation.json"
    with clips_loader(location, config, opened.device, depth=opened.needs_depth, seed=seed) as loader:
        record = {
            "model_sha256": opened.card.weights_sha256,
            "steps": opened.card.steps,
            "release": release.digest,
            "was_trained_on": release.digest in opened.card.releases,
            "seed": seed,
            "flow_shift": flow_shift,
            "held_out": config_json(config),
        }
        write_text(out / "run.json", json.dumps(record, indent=1) + "\n")
        table = evaluate(opened.model, loader, config, path, decoding=opened.decoding, shift=flow_shift, quiet=quiet)
    typer.echo(table)
    typer.echo(f"numbers: {path}")
