"""The options of commands that run stages: each arrives where it belongs, and without one the dataclass decides."""

from dataclasses import fields, replace
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from pipelines.commands import run, select, verify
from pipelines.commands.stage_options import filling, reading
from pipelines.operations import run_recipe, run_stage
from pipelines.operations import select as selecting
from pipelines.running.engines.choice import EngineName
from pipelines.running.options import RunOptions, StageRequest

ASKED = {
    "--unit-timeout 60": {"unit_timeout": 60.0},
    "--slurm partition=gpu --slurm time_min=5": {"slurm": ("partition=gpu", "time_min=5")},
    "-o there": {"out": Path("there")},
    "--config my.toml": {"config": Path("my.toml")},
    "-s a=1 --set b.c=2": {"assignments": ("a=1", "b.c=2")},
    "--engine ray": {"engine": EngineName.RAY},
    "--workers 3": {"workers": 3},
    "--gpus 2": {"gpus": 2},
    "--limit 4": {"limit": 4},
    "--only a* --only b": {"only": ("a*", "b")},
    "--dry-run": {"dry_run": True},
    "--max-refused 0.3": {"max_refused": 0.3},
    "--fork": {"fork": True},
    "--retry-refused": {"retry_refused": True},
    "--retry-reason frame.empty": {"retry_reasons": ("frame.empty",)},
    "--reclaim": {"reclaim": True},
    "-q": {"quiet": True},
    "-v": {"verbose": True},
    "--log-file /dev/null": {"log_file": Path("/dev/null")},
}
REQUESTED = ("out", "config", "assignments", "engine", "slurm", "unit_timeout", "log_file")


def request(**changes):
    of_request = {name: changes[name] for name in changes if name in REQUESTED}
    options = {name: changes[name] for name in changes if name not in REQUESTED}
    return StageRequest(**of_request, options=replace(RunOptions(workers=0), **options))


@pytest.fixture(params=["filling", "reading", "run", "select", "verify"])
def ask(request, monkeypatch):
    """Types words after one of the kinds of commands; returns what it was asked for."""
    seen = []
    monkeypatch.setattr(run_recipe, "run_recipe", lambda recipe, asked: seen.append(asked))
    monkeypatch.setattr(run_stage, "run_one", lambda name, asked, release: seen.append(asked))
    monkeypatch.setattr(selecting, "run_select", lambda release, asked, **own: seen.append(asked))
    calls = {
        "filling": (filling(lambda request: seen.append(request)), []),
        "reading": (reading(lambda release, request: seen.append(request)), ["release"]),
        "run": (run.RUN_COMMAND.call, ["demo"]),
        "select": (select.COMMAND.call, ["release"]),
        "verify": (verify.COMMAND.call, ["release"]),
    }
    call, arguments = calls[request.param]
    app = typer.Typer()
    app.command()(call)

    def type_words(*words):
        done = CliRunner().invoke(app, [*arguments, *words], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        return seen[-1]

    return type_words


def test_every_option_alone_changes_what_it_names_and_nothing_else(ask):
    for words, changes in ASKED.items():
        needed = () if words.startswith("-o") else ("--out", "x")
        assert ask(*needed, *words.split()) == request(**{"out": Path("x"), **changes}), words


def test_a_release_may_be_looked_at_without_a_folder():
    seen = []
    app = typer.Typer()
    app.command()(reading(lambda release, request: seen.append((release, request))))
    CliRunner().invoke(app, ["somewhere"])
    assert seen == [("somewhere", StageRequest())]


def test_a_stage_that_fills_a_folder_must_be_given_one():
    app = typer.Typer()
    app.command()(filling(lambda request: None))
    done = CliRunner().invoke(app, [])
    assert done.exit_code == 2
    assert "--out" in done.output


def test_every_field_of_a_request_has_an_option():
    fields_of = {field.name for kind in (StageRequest, RunOptions) for field in fields(kind)} - {"options"}
    assert {name for changes in ASKED.values() for name in changes} == fields_of


def test_0_workers_are_one_for_each_core(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 5)
    assert (RunOptions(workers=0).processes, RunOptions(workers=3).processes, RunOptions().processes) == (5, 3, 1)
