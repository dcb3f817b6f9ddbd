"""What every command that runs stages takes: the options, and the value that they become."""

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Any

from pipelines.commands.options import (
    Assignments,
    Config,
    DryRun,
    Engine,
    Fork,
    Gpus,
    Limit,
    LogFile,
    MaxRefused,
    Only,
    Out,
    OutOfRelease,
    Quiet,
    Reclaim,
    Release,
    RetryReasons,
    RetryRefused,
    Slurm,
    UnitTimeout,
    Verbose,
    Workers,
)
from pipelines.running.options import RunOptions, StageRequest

REQUEST = StageRequest()
"""What stages are asked where the command line says nothing: the defaults of the options."""

_OF_REQUEST: Mapping[str, object] = {
    "config": Config,
    "assignments": Assignments,
    "engine": Engine,
    "slurm": Slurm,
    "unit_timeout": UnitTimeout,
    "log_file": LogFile,
}
_OF_RUN: Mapping[str, object] = {
    "workers": Workers,
    "gpus": Gpus,
    "limit": Limit,
    "only": Only,
    "dry_run": DryRun,
    "max_refused": MaxRefused,
    "fork": Fork,
    "retry_refused": RetryRefused,
    "retry_reasons": RetryReasons,
    "reclaim": Reclaim,
    "quiet": Quiet,
    "verbose": Verbose,
}
"""Options by the field of `StageRequest` or `RunOptions` that each fills."""


def filling(run: Callable[..., None]) -> Callable[..., None]:
    """A command that fills a folder: the options of stages, which `run` gets as `request`, after its own parameters."""
    return _with_options(run, Parameter("out", Parameter.KEYWORD_ONLY, annotation=Out))


def reading(run: Callable[..., None]) -> Callable[..., None]:
    """As `filling`, for a command that looks at a `release`; a folder need not be given."""
    release = Parameter("release", Parameter.KEYWORD_ONLY, annotation=Release)
    return _with_options(run, _option("out", OutOfRelease, REQUEST.out), release)


def stage_request(values: Mapping[str, Any]) -> StageRequest:
    """The options of a command that runs stages as one value; others among the values are left out."""
    given: dict[str, Any] = {
        name: tuple(value or ()) if name in ("only", "assignments", "retry_reasons", "slurm") else value
        for name, value in values.items()
    }
    options = RunOptions(**{name: given[name] for name in _OF_RUN if name in given})
    of_request = {name: given[name] for name in _OF_REQUEST if name in given}
    out = given.get("out")
    return StageRequest(**of_request, out=None if out is None else Path(out), options=options)


def _with_options(run: Callable[..., None], out: Parameter, *first: Parameter) -> Callable[..., None]:
    """`run` as typer reads it: the words of a command are those of a signature, and this one is put together."""
    named = {one.name for one in first}
    own = [one for one in signature(run).parameters.values() if one.name not in {"request", *named}]
    options = [_option(name, kind, getattr(REQUEST, name)) for name, kind in _OF_REQUEST.items()]
    options += [_option(name, kind, getattr(REQUEST.options, name)) for name, kind in _OF_RUN.items()]
    outs = [] if "out" in signature(run).parameters else [out]  # a command may take more than a path
    parameters = [*first, *(one.replace(kind=Parameter.KEYWORD_ONLY) for one in own), *outs, *options]
    passed = {*named, *(one.name for one in own)}

    def command(**values: Any) -> None:
        from pipelines.running.logs import logged

        request = stage_request(values)
        with logged(request):
            run(**{name: values[name] for name in passed}, request=request)

    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in parameters}
    return command


def _option(name: str, annotation: object, default: object) -> Parameter:
    default = None if default == () else default  # typer's word for a repeatable option that is not there
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
