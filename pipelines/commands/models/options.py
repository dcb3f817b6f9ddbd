"""Options and arguments of the commands on a trained model."""

from pathlib import Path
from typing import Annotated

import typer

Model = Annotated[Path, typer.Argument(metavar="MODEL", help="Folder of a model: RUN/model of wsm train.")]
FlowShift = Annotated[float, typer.Option("--flow-shift", min=0.001, help="Gamma of the flow time, as in training.")]
CodecWeights = Annotated[str, typer.Option("--codec-weights", help="Folder of the codec's weights, where it has any.")]
HeldOutAssignments = Annotated[
    list[str] | None,
    typer.Option("--set", "-s", help="One setting of [held_out] of training, as session.chunk_size=2. Repeatable."),
]
