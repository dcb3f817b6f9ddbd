"""`wsm`: one command per stage, all with the same options, and commands that run them in order or look at a release."""

import errno
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from pipelines.recipe import recipe_summaries
from pipelines.registry import STAGES, StageEntry
from pipelines.running.engines.choice import EngineName
from wsm_data.curation.audit.finding import Severity
from wsm_data.curation.split import SplitBy
from wsm_data.errors import ConfigError, WsmError

_INTERRUPTED_EXIT_CODE = 130


class FailOn(StrEnum):
    """From which severity on an audit fails."""

    INFO = Severity.INFO.value
    WARNING = Severity.WARNING.value
    ERROR = Severity.ERROR.value
    NEVER = "never"


class _Commands(TyperGroup):
    """Turns foreseen errors into one message and their exit code; anything else keeps its traceback."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except WsmError as error:
            _fail(str(error), error.exit_code)
        except KeyboardInterrupt:
            _fail("interrupted; run the same command again to go on where it stopped", _INTERRUPTED_EXIT_CODE)
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            _fail(f"the disk is full ({error}); free space and run the same command again", 1)


app = typer.Typer(
    cls=_Commands,
    help="From navigation trajectories to a verified release of shards for the World SLAM Model.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_OPTIONS: dict[str, tuple[Any, Any]] = {
    "out": (
        Annotated[Path, typer.Option("--out", "-o", help="Folder to write; what is done there is kept.")],
        inspect.Parameter.empty,
    ),
    "config": (
        Annotated[Path | None, typer.Option("--config", "-c", help="TOML of differences, with a section per stage.")],
        None,
    ),
    "assignments": (
        Annotated[
            list[str] | None,
            typer.Option("--set", "-s", help="One setting: key=value or section.key=value. Repeatable."),
        ],
        None,
    ),
    "workers": (Annotated[int, typer.Option("--workers", "-w", min=0, help="Worker processes; 0: one a core.")], 0),
    "engine": (
        Annotated[EngineName, typer.Option("--engine", help="Where workers run: this machine, ray or Slurm.")],
        EngineName.LOCAL,
    ),
    "limit": (Annotated[int, typer.Option("--limit", min=0, help="At most this many pending units; 0: all.")], 0),
    "only": (
        Annotated[
            list[str] | None, typer.Option("--only", help="Only units whose id matches, as 'gibson_*/*'. Repeatable.")
        ],
        None,
    ),
    "dry_run": (
        Annotated[bool, typer.Option("--dry-run", help="Show settings and what would be done; write nothing.")],
        False,
    ),
    "max_refused": (
        Annotated[
            float,
            typer.Option("--max-refused", min=0, help="Stop when more units are refused: share below 1, or number."),
        ],
        0.1,
    ),
    "fork": (
        Annotated[bool, typer.Option("--fork", help="With changed settings, write beside --out instead of stopping.")],
        False,
    ),
    "retry_refused": (
        Annotated[bool, typer.Option("--retry-refused", help="Try again what was refused before.")],
        False,
    ),
    "quiet": (Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars.")], False),
}
"""The options of every command that runs stages: annotation and default. A test holds the defaults to those of
`pipelines.running.runner.RunOptions`, which is not imported here: `wsm --help` would wait for it."""

_OUT_OPTIONAL = (
    Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Folder to write; verify needs none, others take one named like the command."),
    ],
    None,
)

ReleaseArgument = Annotated[str, typer.Argument(metavar="RELEASE", help="Folder or URL of a release.")]

_NO_ARGUMENTS: Mapping[str, Any] = MappingProxyType({})


def _command(
    name: str,
    summary: str,
    call: Callable[..., None],
    *,
    arguments: Mapping[str, Any] = _NO_ARGUMENTS,
    own_options: Mapping[str, tuple[Any, Any]] = _NO_ARGUMENTS,
    epilog: str = "",
) -> None:
    """Register a command that takes `arguments` (annotations by name), options of its own, and all of `_OPTIONS`."""
    options = {**own_options, **_OPTIONS} | ({"out": _OUT_OPTIONAL} if "release" in arguments else {})
    parameters = [
        *(inspect.Parameter(one, inspect.Parameter.KEYWORD_ONLY, annotation=kind) for one, kind in arguments.items()),
        *(
            inspect.Parameter(one, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)
            for one, (kind, default) in options.items()
        ),
    ]

    def command(**values: Any) -> None:
        call(**values)

    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    app.command(name, help=summary, epilog=epilog)(command)


def _load(module: str) -> Any:
    """A command's module, loaded when the command runs: `wsm --help` needs neither numpy nor OpenCV."""
    return importlib.import_module(f"pipelines.commands.{module}")


def _require_extra(extra: str, packages: tuple[str, ...]) -> None:
    """Say which extra brings what a command needs, in place of a traceback of its imports."""
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise ConfigError(f"this command needs {', '.join(missing)}: install wsm with the extra `{extra}`")


def _fail(message: str, code: int) -> None:
    typer.echo(f"error: {message}", err=True)
    sys.exit(code)


def _recipe_list() -> str:
    """The recipes of the project, one a line; the first line keeps click from wrapping them."""
    return "\n".join(["\b", "Recipes:", *(f"  {name}: {summary}" for name, summary in recipe_summaries().items())])


_SELECT_OPTIONS: Mapping[str, tuple[Any, Any]] = MappingProxyType(
    {
        "report": (Annotated[bool, typer.Option("--report", help="Write NAME.html: what was chosen, and why.")], False),
        "materialise": (
            Annotated[
                Path | None,
                typer.Option("--materialise", help="Folder for the chosen clips as a release of their own, verified."),
            ],
            None,
        ),
        "weights": (
            Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, for pictures.")],
            "",
        ),
    }
)


def _add_stage_command(entry: StageEntry) -> None:
    arguments = {"release": ReleaseArgument} if entry.reads_release else {}
    if entry.name == "select":
        call, own = (lambda **values: _load("select").run_select(**values)), _SELECT_OPTIONS
    else:
        call, own = (lambda **values: _load("stages").run_one(entry.name, **values)), _NO_ARGUMENTS
    _command(entry.name, entry.summary, call, arguments=arguments, own_options=own)


for _entry in STAGES:
    _add_stage_command(_entry)

_command(
    "run",
    "Run the stages of a recipe into one run folder.",
    lambda **values: _load("stages").run_recipe(**values),
    epilog=_recipe_list(),
    arguments={
        "recipe": Annotated[str, typer.Argument(metavar="RECIPE", help="Name of a recipe, or path of a TOML file.")]
    },
)
_command(
    "demo",
    "The main job, end to end, on generated data.",
    lambda **values: _load("stages").run_recipe(recipe="demo", **values),
)


@app.command("inspect")
def inspect_release(
    release: ReleaseArgument,
    key: Annotated[
        str | None, typer.Argument(metavar="[KEY]", help="One clip: its key or the id of its trajectory.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Contact sheet to write; default: KEY.png here.")
    ] = None,
    rerun: Annotated[
        Path | None,
        typer.Option(
            "--rerun", help="Recording of the clip (.rrd) to write, in place of a contact sheet without --out."
        ),
    ] = None,
    limit: Annotated[int, typer.Option("--limit", min=0, help="Clips to list; 0: all.")] = 20,
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
) -> None:
    """List a release, or show one clip and draw it."""
    _load("inspect").inspect_release(release, key, out, rerun, limit, weights)


@app.command("audit-run")
def audit_run(
    ledger: Annotated[Path, typer.Argument(metavar="LEDGER", help="Folder in which a loader recorded its steps.")],
    release: Annotated[
        list[str],
        typer.Option("--release", help="Release of the run: every step is compared with its order. Repeatable."),
    ],
    selection: Annotated[
        list[str] | None,
        typer.Option("--selection", help="Selection file of the run that is not in its release. Repeatable."),
    ] = None,
    clip: Annotated[str | None, typer.Option("--clip", help="Show the steps that brought this clip.")] = None,
    epoch: Annotated[int | None, typer.Option("--epoch", min=0, help="Epoch of --step.")] = None,
    step: Annotated[int | None, typer.Option("--step", min=0, help="Show what this step brought.")] = None,
) -> None:
    """Prove from its ledger that a training run saw each clip once an epoch."""
    _load("audit_run").audit_run(ledger, release, selection or [], clip, epoch, step)


@app.command("audit")
def audit(
    release: ReleaseArgument,
    split_by: Annotated[
        SplitBy, typer.Option("--split-by", help="What the split promises to keep on one side.")
    ] = SplitBy.TRAJECTORY,
    fail_on: Annotated[
        FailOn, typer.Option("--fail-on", help="Mildest finding that ends with exit code 4.")
    ] = FailOn.ERROR,
    near_m: Annotated[
        float, typer.Option("--near", help="Paths that stay this close, in metres, count as near-duplicates.")
    ] = 0.5,
    as_json: Annotated[bool, typer.Option("--json", help="All findings as JSON.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar.")] = False,
) -> None:
    """Find split leaks, repeated content and contradicting labels of a release."""
    _load("audit").audit(release, split_by, fail_on.value, near_m, as_json, quiet)


@app.command("train")
def train(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the run; it goes on from its last checkpoint.")],
    release: Annotated[
        str | None, typer.Argument(metavar="[RELEASE]", help="Release to train on, unless the settings name sources.")
    ] = None,
    config: Annotated[Path | None, typer.Option("--config", "-c", help="TOML of differences to the defaults.")] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", "-s", help="One setting: section.key=value. Repeatable.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show settings and sizes; write nothing.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars.")] = False,
) -> None:
    """Pretrain the model; on several GPUs: torchrun -m pipelines.cli train ..."""
    _require_extra("train", ("safetensors", "tensorboard"))
    _load("train").train(release, out, config, assignments, dry_run, quiet)


bench = typer.Typer(help="Measure a part of the pipeline on this machine.", no_args_is_help=True)
app.add_typer(bench, name="bench")


@bench.command("loader")
def bench_loader(
    release: ReleaseArgument,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", help="One setting, as read.threads=4, order.global_batch=16, source.split=test."),
    ] = None,
    batches: Annotated[int, typer.Option("--batches", min=1, help="Batches to take at most.")] = 1000,
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, help="Time to measure at most, s.")] = 5.0,
    step_ms: Annotated[
        float, typer.Option("--step-ms", min=0, help="Time a training step takes, ms; 0: take batches as they come.")
    ] = 0.0,
    ranks: Annotated[int, typer.Option("--ranks", min=1, help="Ranks of the run; rank 0 is measured here, alone.")] = 1,
    sweep: Annotated[bool, typer.Option("--sweep", help="Compare 1, 2 and 4 threads too.")] = False,
) -> None:
    """The loader doctor: run the real loader, say what holds it up and what to change."""
    _load("bench").bench_loader(release, assignments or [], batches, seconds, step_ms / 1000, ranks, sweep)


if __name__ == "__main__":
    app()
