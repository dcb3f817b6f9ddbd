"""`wsm eval`: the evaluations of the paper."""

from pipelines.commands import eval_nav
from pipelines.commands.command import CommandGroup

GROUP = CommandGroup(
    name="eval", summary="Evaluate a planner or a model, as the paper's tables do.", commands=(eval_nav.COMMAND,)
)
