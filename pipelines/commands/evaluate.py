"""`wsm eval`: the evaluations of the paper."""

from pipelines.commands import eval_nav, eval_slam, eval_table
from pipelines.commands.command import CommandGroup
from pipelines.commands.models import eval_clips

GROUP = CommandGroup(
    name="eval",
    summary="Evaluate a planner, a model or another system, as the paper's tables do.",
    commands=(eval_nav.COMMAND, eval_slam.COMMAND, eval_clips.COMMAND, eval_table.COMMAND),
)
