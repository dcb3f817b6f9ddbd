"""`wsm verify`: a stage like the others where it is given a folder, and a proof without a record where it is not."""

from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.stage_options import reading
from pipelines.running.options import StageRequest


def verify(
    release: str,
    request: StageRequest,
    payload: Annotated[
        bool,
        typer.Option(
            "--payload/--no-payload", help="Read every shard; without: sizes, and the checksums that a store states."
        ),
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print all findings as JSON, without --out. Exit code 4 where there are any.")
    ] = False,
) -> None:
    """Verify a release."""
    from pipelines.operations.run_stage import run_one
    from pipelines.operations.verify import verify_as_json, verify_stored, verify_without_record

    if as_json:
        verify_as_json(release, request, payload)
    elif not payload:
        verify_stored(release, request)
    elif request.out is None:
        verify_without_record(release, request)
    else:
        run_one("verify", request, release)


COMMAND = Command(name="verify", summary="Prove that a release is whole, or name the damage.", call=reading(verify))
