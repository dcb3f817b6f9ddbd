"""`wsm verify` without a folder: every byte is read, or none of the shards, and nothing is recorded."""

import json
from dataclasses import fields

import typer

from pipelines.running.options import RunOptions, StageRequest
from pipelines.stages.verify import require_no_finding, require_sound, sound_findings
from wsm_data.access.transfer.stored import check_stored
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.json_values import to_json


def verify_without_record(release: str, request: StageRequest) -> None:
    """Prove that a release is whole.

    Raises:
        ConfigError: an option is given that would do nothing.
        IntegrityError: lists what is damaged, by shard and clip.
    """
    _refuse_unused(request)
    clips = require_sound(release, request.options.quiet)
    typer.echo(f"{release} is whole: {clips} clips, every byte and every trajectory accounted for")


def verify_stored(release: str, request: StageRequest) -> None:
    """Compare what a store says of a release with its manifest, without reading shards.

    Raises:
        ConfigError: there is no such folder, or an option is given that would do nothing.
        IntegrityError: lists what is wrong.
    """
    _refuse_unused(request)
    if request.out is not None:
        raise ConfigError("--no-payload records nothing: leave out --out, or read the shards too")
    check = check_stored(release)
    require_no_finding(release, check.findings)
    by = f"{check.by_checksum} of them by the store's checksum too" if check.by_checksum else "none by a checksum"
    typer.echo(
        f"{release} has all {check.shards} shards in their sizes, {by}; index, inventory and quarantine were read. No "
        "clip was read: `wsm verify` without --no-payload does that"
    )


def verify_as_json(release: str, request: StageRequest, payload: bool) -> None:
    """Print all that is wrong with a release as JSON: an empty list where it is whole.

    Args:
        release: folder or URL of the release.
        request: what else was asked for.
        payload: whether shards are read, or only what a store says of them.

    Raises:
        ConfigError: there is no such folder, or an option is given that would do nothing.
        IntegrityError: something was found; it is printed already.
    """
    _refuse_unused(request)
    if request.out is not None:
        raise ConfigError("--json is for a release that is verified without a record: leave out --out")
    findings = sound_findings(release, request.options.quiet) if payload else check_stored(release).findings
    record = {"release": release, "payload": payload, "whole": not findings, "findings": to_json(list(findings))}
    typer.echo(json.dumps(record, indent=2))
    if findings:
        raise IntegrityError(f"{release} is damaged, {len(findings)} finding{'s' if len(findings) > 1 else ''}")


def _refuse_unused(request: StageRequest) -> None:
    """There are neither settings nor units: only `quiet` counts."""
    unset = StageRequest()
    given = [
        field.name
        for field in fields(RunOptions)
        if field.name != "quiet" and getattr(request.options, field.name) != getattr(unset.options, field.name)
    ]
    given += ["engine"] if request.engine != unset.engine else []
    given += ["config"] if request.config else []
    given += ["set"] if request.assignments else []
    if given:
        words = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise ConfigError(
            f"without --out the whole release is read and nothing is recorded, so {words} would do nothing: leave that "
            "out, or add --out FOLDER"
        )
