"""`wsm verify`: a stage like the others where it is given a folder, and a proof without a record where it is not."""

from pipelines.commands.command import Command
from pipelines.commands.stage_options import reading
from pipelines.running.options import StageRequest


def verify(release: str, request: StageRequest) -> None:
    """Verify a release."""
    from pipelines.operations.run_stage import run_one
    from pipelines.operations.verify import verify_without_record

    if request.out is None:
        verify_without_record(release, request)
    else:
        run_one("verify", request, release)


COMMAND = Command(name="verify", summary="Prove that a release is whole, or name the damage.", call=reading(verify))
