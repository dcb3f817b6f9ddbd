"""`wsm dream`: a picture or a film of what a trained model makes of one clip."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.extras import require_extra
from pipelines.commands.models.options import CodecWeights, FlowShift, HeldOutAssignments, Model
from pipelines.commands.options import Release


def dream(
    model: Model,
    release: Release,
    clip: Annotated[str, typer.Argument(metavar="CLIP", help="Key of a clip; `wsm inspect RELEASE` lists them.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="PNG, or MP4 of true beside dreamed frames; replaced.")],
    assignments: HeldOutAssignments = None,
    flow_shift: FlowShift = 5.0,
    codec_weights: CodecWeights = "",
) -> None:
    """Draw dreamed RGB, estimated depth and estimated path beside the truth."""
    require_extra("train", ("safetensors",))
    from pipelines.operations.models import dream as operation
    from pipelines.operations.models.opened import held_out_config

    config = held_out_config(assignments or [], {})
    operation.dream(model, release, clip, out, config, flow_shift=flow_shift, codec_weights=codec_weights)


COMMAND = Command(name="dream", summary="Draw or film what a model dreams of a clip, beside the truth.", call=dream)
