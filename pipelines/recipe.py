"""Recipes: a named list of stages with differences from their defaults, wired into one run folder."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from pipelines.config import build_config, load_toml, merge
from pipelines.registry import STAGES, load_stage
from wsm_data.errors import ConfigError

_FOLDER = Path(__file__).parent / "recipes"
_NAMES = tuple(entry.name for entry in STAGES)


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What a run does.

    Attributes:
        stages: names of the stages, in the order of the flow.
        settings: differences to the defaults, by stage.
        source: source tree of the first stage; empty where the run generates its own.
    """

    stages: tuple[str, ...]
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    source: str = ""


def load_recipe(name: str, config: Path | None, changes: Mapping[str, Any]) -> Recipe:
    """Read a recipe by name or path, and lay a config file and `--set` words over it.

    Raises:
        ConfigError: there is no such recipe, or it speaks of stages or keys that do not exist.
    """
    values = load_toml(_recipe_path(name))
    if config is not None:
        values = merge(values, load_toml(config))
    values = merge(values, changes)
    stages = tuple(values.pop("stages", ()))
    source = str(values.pop("source", ""))
    values.pop("summary", None)
    unknown = [one for one in (*stages, *values) if one not in _NAMES]
    if unknown or not stages:
        raise ConfigError(_unknown_section(unknown, name))
    return Recipe(stages=tuple(one for one in _NAMES if one in stages), settings=values, source=source)


def stage_config(recipe: Recipe, name: str, run: Path) -> Any:
    """The config of one stage of a run: every input field named after a stage is that stage's folder in the run."""
    stage = load_stage(name)
    inputs: dict[str, Any] = {
        one.name: str(run / one.name)
        for one in fields(stage.config_type)
        if one.metadata.get("role") == "input" and one.name in _NAMES
    }
    if name == "index":
        inputs["source"] = _source(recipe, run)
    if name in ("verify", "report"):
        inputs["release"] = str(run / "pack" / "release")
    return build_config(stage.config_type, merge(inputs, recipe.settings.get(name, {})), name)


def recipe_names() -> Sequence[str]:
    """Names of the recipes that come with the project."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def _source(recipe: Recipe, run: Path) -> str:
    if "synth" in recipe.stages:
        return str(run / "synth" / "tree")
    if not recipe.source:
        raise ConfigError("this recipe reads a source tree: give it with --set source=PATH")
    return recipe.source


def _recipe_path(name: str) -> Path:
    path = _FOLDER / f"{name}.toml"
    if path.exists():
        return path
    if Path(name).suffix == ".toml":
        return Path(name)
    nearest = difflib.get_close_matches(name, recipe_names(), n=1)
    hint = f"did you mean {nearest[0]}?" if nearest else f"recipes: {', '.join(recipe_names())}, or a TOML file"
    raise ConfigError(f"there is no recipe {name!r}; {hint}")


def _unknown_section(unknown: Sequence[str], recipe: str) -> str:
    if not unknown:
        return f"recipe {recipe} must list its stages: stages = [{', '.join(_NAMES)}]"
    nearest = difflib.get_close_matches(unknown[0], [*_NAMES, "source", "stages"], n=1)
    hint = f"did you mean {nearest[0]}?" if nearest else f"stages: {', '.join(_NAMES)}"
    return f"recipe {recipe}: {unknown[0]!r} is neither a stage nor a key of a recipe; {hint}"
