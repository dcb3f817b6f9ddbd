"""`wsm settings`: every setting with its type, default and meaning, as text, JSON or the page docs/settings.md."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from importlib import import_module

import typer

from pipelines.registry import STAGES, load_stage
from pipelines.running.described_settings import Setting, describe_settings
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean

_OF_MODELS: Mapping[str, tuple[str, str]] = {
    "train": ("pipelines.training.config", "TrainRunConfig"),
    "posttrain": ("pipelines.posttraining.config", "PosttrainRunConfig"),
}
"""They bring torch, for which settings of a stage need not wait."""

_HEAD = """# Settings

All settings of the stages, of `wsm train` and of `wsm posttrain`, as `wsm settings` prints them. This page is written
by `wsm settings --markdown > docs/settings.md`. The command of a stage takes a setting as it stands here
(`wsm encode --set clip.width=640`); `wsm run` takes it behind the name of the stage (`--set encode.clip.width=640`).
[pipeline.md](pipeline.md#settings) says which value wins. `[]` is a list of sections, `NAME` a name of your own.
"""


def show_settings(stage: str | None, as_json: bool, as_markdown: bool) -> None:
    """Print the settings of a stage, or of all.

    Raises:
        ConfigError: there is no such stage, or two forms are asked for at once.
    """
    if as_json and as_markdown:
        raise ConfigError("--json and --markdown are two forms of the same list; give one of them")
    described = settings_by_command(stage)
    if as_json:
        rows = {name: [asdict(one) for one in settings] for name, settings in described.items()}
        typer.echo(json.dumps(rows, indent=2))
    elif as_markdown:
        typer.echo(markdown_page(described), nl=False)
    else:
        typer.echo("\n\n".join(_text(name, settings) for name, settings in described.items()))


def settings_by_command(only: str | None = None) -> dict[str, tuple[Setting, ...]]:
    """Settings by the command that takes them, in the order of the flow, training last.

    Args:
        only: one of the commands; None: all.

    Raises:
        ConfigError: there is no such command.
    """
    known = [*(entry.name for entry in STAGES), *_OF_MODELS]
    if only is not None and only not in known:
        raise ConfigError(f"there is no stage {only!r}; {did_you_mean(only, known)}")
    return {name: tuple(describe_settings(_config_type(name))) for name in known if only in (None, name)}


def markdown_page(described: Mapping[str, Sequence[Setting]]) -> str:
    """The page of the settings: a table for each command."""
    return "\n".join([_HEAD, *(_markdown(name, settings) for name, settings in described.items())])


def _config_type(name: str) -> type:
    if name not in _OF_MODELS:
        return load_stage(name).config_type
    module, config = _OF_MODELS[name]
    found: type = getattr(import_module(module), config)
    return found


def _text(name: str, settings: Iterable[Setting]) -> str:
    lines = [f"{name}: settings"]
    for one in settings:
        default = f", default {one.default}" if one.default else ""
        lines += [f"  {one.name} ({one.type}{default})", f"      {one.meaning}"]
    return "\n".join(lines).replace(", default required)", ", required)")


def _markdown(name: str, settings: Iterable[Setting]) -> str:
    lines = [f"## {name}\n", "| setting | takes | default | meaning |", "|---|---|---|---|"]
    for one in settings:
        default = f"`{one.default}`" if one.default else ""
        cells = (f"`{one.name}`", one.type, default, one.meaning)
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines) + "\n"
