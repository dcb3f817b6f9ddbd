"""`wsm eval clips`: a trained model on clips of a release, as `wsm train` measures it at its end."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.extras import require_extra
from pipelines.commands.models.options import CodecWeights, FlowShift, HeldOutAssignments, Model
from pipelines.commands.options import Quiet, Release


def clips(
    model: Model,
    release: Release,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of evaluation.json and run.json; replaced.")],
    split: Annotated[str | None, typer.Option("--split", help="Split of the clips; test.")] = None,
    count: Annotated[int | None, typer.Option("--clips", min=1, help="At most this many; 16.")] = None,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Of the order in which clips are taken; 0: that of wsm train.")
    ] = 0,
    assignments: HeldOutAssignments = None,
    flow_shift: FlowShift = 5.0,
    codec_weights: CodecWeights = "",
    quiet: Quiet = False,
) -> None:
    """Measure states, dreams and the flow-matching loss."""
    require_extra("train", ("safetensors",))
    from pipelines.operations.models import eval_clips as operation
    from pipelines.operations.models.opened import held_out_config

    given = {name: value for name, value in (("split", split), ("clips", count)) if value is not None}
    config = held_out_config(assignments or [], given)
    operation.eval_clips(
        model, release, out, config, seed=seed, flow_shift=flow_shift, codec_weights=codec_weights, quiet=quiet
    )


COMMAND = Command(name="clips", summary="States and dreams of a model on clips, beside what knows nothing.", call=clips)
