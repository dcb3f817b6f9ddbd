"""`wsm eval`: the evaluations of the paper."""

from pipelines.commands.command import CommandGroup
from pipelines.commands.evaluating import nav, slam, table
from pipelines.commands.models import eval_clips

GROUP = CommandGroup(
    name="eval",
    summary="Evaluate a planner, a model or another system, as the paper's tables do.",
    commands=(nav.COMMAND, slam.COMMAND, eval_clips.COMMAND, table.COMMAND),
)
