"""`wsm model export` and `wsm model push`: a trained model for other programs and other people."""

from pathlib import Path

import typer

from wsm_data.errors import ConfigError
from wsm_model.hub import push_to_hub
from wsm_model.model_file import load_model, save_model
from wsm_model.precision import Precision
from wsm_model.weights.to_diffusers import write_diffusers


def export_model(folder: Path, out: Path, layout: str, weights: str) -> None:
    """Write a model in a layout, its matrices in a precision.

    Raises:
        ConfigError: there is no model, it would replace itself, or it has no place in the layout.
        IntegrityError: its files are damaged.
    """
    if out.resolve() == folder.resolve():
        raise ConfigError(f"--out must be another folder than that of the model, found {out} for both")
    model, card = load_model(folder, precision=Precision(weights))
    if layout == "diffusers":
        write_diffusers(out, model)
    else:
        save_model(out, model, card)
    size = sum(path.stat().st_size for path in out.glob("*.safetensors"))
    typer.echo(f"model: {out}, {size / 1e6:,.1f} MB of weights")


def push_model(folder: Path, place: str, *, private: bool) -> None:
    """Put a model somewhere, and say where.

    Raises:
        ConfigError: there is no model, or the Hub refuses it.
        IntegrityError: its files are damaged.
    """
    typer.echo(f"model: {push_to_hub(folder, place, private=private)}")
