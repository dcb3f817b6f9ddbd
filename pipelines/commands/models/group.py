"""`wsm model`: a trained model in the layout of other programs, and where others find it."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command, CommandGroup
from pipelines.commands.extras import require_extra
from pipelines.commands.models.options import Model


class Layout(StrEnum):
    """Layouts of a model's files."""

    WSM = "wsm"
    DIFFUSERS = "diffusers"


class Weights(StrEnum):
    """How matrices are stored."""

    FLOAT32 = "float32"
    BFLOAT16 = "bfloat16"


def export(
    model: Model,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write; its model is replaced.")],
    layout: Annotated[
        Layout, typer.Option("--layout", help="wsm: all of it; diffusers: the RGB expert as a WanTransformer3DModel.")
    ] = Layout.WSM,
    weights: Annotated[
        Weights, typer.Option("--weights", help="Of the matrices; norms, tables and the pose head stay float32.")
    ] = Weights.BFLOAT16,
) -> None:
    """Write a model in another layout, or with weights of half the size."""
    require_extra("train", ("safetensors",))
    from pipelines.operations.models.export_model import export_model

    export_model(model, out, layout.value, weights.value)


def push(
    model: Model,
    place: Annotated[
        str, typer.Argument(metavar="PLACE", help="Repository owner/name of the Hub, or a folder: ./NAME.")
    ],
    private: Annotated[bool, typer.Option("--private", help="A repository that is made now is private.")] = False,
) -> None:
    """Put a model where others find it; `wsm_model.hub.from_pretrained` reads it from there."""
    require_extra("hub", ("huggingface_hub", "safetensors"))
    from pipelines.operations.models.export_model import push_model

    push_model(model, place, private=private)


GROUP = CommandGroup(
    name="model",
    summary="Write a trained model for other programs, and put it where others find it.",
    commands=(
        Command(name="export", summary="Write a model in bfloat16, or its RGB expert for diffusers.", call=export),
        Command(name="push", summary="Put a model on the Hugging Face Hub, or into a folder.", call=push),
    ),
)
