"""Recipes: a named list of stages with differences from their defaults, wired into one run folder."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.artifacts.layout import release_folder
from pipelines.registry import STAGES, load_stage
from pipelines.running.settings import input_fields, merge
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config, convert, did_you_mean, load_toml

_FOLDER = Path(__file__).parent / "recipes"
_NAMES = tuple(entry.name for entry in STAGES)
_READS_RELEASE = frozenset(entry.name for entry in STAGES if entry.reads_release)
_KEYS: Mapping[str, object] = {"stages": tuple[str, ...], "source": str, "summary": str}


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What a run does.

    Attributes:
        stages: names of the stages, in the order of the flow.
        settings: differences to the defaults, by stage.
        source: source tree of the first stage; empty where the run generates its own.
    """

    stages: tuple[str, ...]
    settings: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    source: str = ""


def load_recipe(name: str, config: Path | None, changes: Mapping[str, object]) -> Recipe:
    """Read a recipe by name or path, and lay a config file and `--set` words over it.

    Raises:
        ConfigError: there is no such recipe, or it speaks of stages or keys that do not exist.
    """
    values = load_toml(_recipe_path(name))
    if config is not None:
        values = merge(values, load_toml(config))
    values = merge(values, changes)
    settings = stage_sections(values, f"recipe {name}")
    top = {key: convert(kind, values[key], key) for key, kind in _KEYS.items() if key in values}
    stages = top.get("stages", ())
    if not stages:
        raise ConfigError(f"recipe {name} must list its stages: stages = [{', '.join(_NAMES)}]")
    _require_known(stages, _NAMES, f"recipe {name}")
    return Recipe(stages=tuple(one for one in _NAMES if one in stages), settings=settings, source=top.get("source", ""))


def stage_sections(values: Mapping[str, object], where: str) -> dict[str, Mapping[str, object]]:
    """The sections of a TOML file that are settings of stages.

    Raises:
        ConfigError: a key is neither the name of a stage nor a key of a recipe, or a stage's name is no section.
    """
    _require_known(values, (*_NAMES, *_KEYS), where)
    sections: dict[str, Mapping[str, object]] = {}
    for name, section in values.items():
        if name in _KEYS:
            continue
        if not isinstance(section, Mapping):
            raise ConfigError(f"{where}: {name} is a section of settings, found the value {section!r}")
        sections[name] = section
    return sections


def stage_config(recipe: Recipe, name: str, run: Path) -> object:
    """The config of one stage of a run.

    Every input field named after a stage is that stage's folder in the run; what looks at the release decodes it with
    the weights that it was encoded with, and the report audits it by what was dealt as a whole.
    """
    stage = load_stage(name)
    wanted = input_fields(stage.config_type)
    inputs: dict[str, object] = {one: str(run / one) for one in wanted if one in _NAMES}
    settings = recipe.settings.get(name, {})
    if name == "index" and "source" not in settings:
        inputs["source"] = _source(recipe, run)
    if name in _READS_RELEASE:
        inputs["release"] = str(release_folder(run / "pack"))
        weights = _codec_settings(recipe).get("weights", "")
        inputs |= {"weights": weights} if "weights" in wanted else {}
    if name == "report" and "by" in recipe.settings.get("split", {}):
        inputs["split_by"] = recipe.settings["split"]["by"]  # the report's audit holds the splits to this
    return build_config(stage.config_type, merge(inputs, settings), name)


def recipe_names() -> Sequence[str]:
    """Names of the recipes that come with the project."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def recipe_summaries() -> Mapping[str, str]:
    """What each recipe that comes with the project is for, by its name."""
    return {name: convert(str, load_toml(_recipe_path(name))["summary"], "summary") for name in recipe_names()}


def _codec_settings(recipe: Recipe) -> Mapping[str, object]:
    codec = recipe.settings.get("encode", {}).get("codec", {})
    return codec if isinstance(codec, Mapping) else {}  # `wsm encode` refuses what is no section


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
    raise ConfigError(f"there is no recipe {name!r}, and it is no TOML file; {did_you_mean(name, recipe_names())}")


def _require_known(found: Iterable[str], known: Sequence[str], where: str) -> None:
    unknown = next((one for one in found if one not in known), None)
    if unknown is not None:
        raise ConfigError(f"{where}: {unknown!r} is not known; {did_you_mean(unknown, known)}")
