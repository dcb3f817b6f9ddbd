"""`wsm run` and `wsm demo`: the stages of a recipe, one after the other, in one run folder."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from pipelines.artifacts.codec_servers import require_gpus
from pipelines.operations.dry_run import show_run
from pipelines.operations.engine import engine_of
from pipelines.operations.run_stage import print_result
from pipelines.operations.runs.in_order import run_in_order
from pipelines.recipe import Recipe, load_recipe, stage_config
from pipelines.registry import load_stage
from pipelines.running.conflict import conflict, fingerprint
from pipelines.running.options import StageRequest
from pipelines.running.settings import merge, parse_assignments
from wsm_data.codecs.registry import CodecConfig, describe_codec
from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json


def run_recipe(recipe: str, request: StageRequest, on_finished: Callable[[str], object] | None = None) -> None:
    """Run the stages of a recipe, each in a folder of its own, and say where the results are.

    The settings of all stages are built, and compared with those their folders were begun with, before the first of
    them runs.

    Args:
        recipe: name or path of the recipe.
        request: what is asked.
        on_finished: called with the name of each stage that came to its end.

    Raises:
        ConfigError: the recipe, a setting or an option is wrong, or a folder belongs to other settings.
    """
    options = request.options
    loaded = load_recipe(recipe, request.config, parse_assignments(request.assignments))
    if options.limit or options.only:  # it narrows the first stage; the release says that it is partial
        packing = merge({"partial": True}, loaded.settings.get("pack", {}))
        loaded = replace(loaded, settings={**loaded.settings, "pack": packing})
    run_engine = engine_of(request)
    out, configs = _choose_folder(loaded, request.out or Path("run"), options.fork)
    _require_gpus(configs, options.gpus)
    first = replace(options, fork=False)
    others = replace(first, limit=0, only=())
    if options.dry_run:
        show_run(configs, out, first, others)
        return
    with run_engine as opened:
        run_in_order(configs, out, lambda name: first if name == next(iter(configs)) else others, opened, on_finished)
    for name in configs:
        print_result(name, out / name)


def _choose_folder(recipe: Recipe, out: Path, fork: bool) -> tuple[Path, Mapping[str, object]]:
    """The run folder and the settings of the stages in it: one beside it after a fork."""
    configs = _checked_configs(recipe, out)
    conflicts = [conflict(load_stage(name), config, out / name) for name, config in configs.items()]
    if not any(conflicts):
        return out, configs
    if not fork:
        raise ConfigError("\n".join(filter(None, conflicts)))
    wanted = {name: fingerprint(load_stage(name), config) for name, config in configs.items()}
    beside = out.with_name(f"{out.name}-{digest_json(wanted)[:8]}")
    return beside, _checked_configs(recipe, beside)


def _require_gpus(configs: Mapping[str, object], gpus: int) -> None:
    codecs = [codec for config in configs.values() if isinstance(codec := getattr(config, "codec", None), CodecConfig)]
    for codec in codecs if gpus else ():
        require_gpus(codec, gpus)


def _checked_configs(recipe: Recipe, out: Path) -> Mapping[str, object]:
    """Settings of every stage, in the order of the flow."""
    configs = {name: stage_config(recipe, name, out) for name in recipe.stages}
    for config in configs.values():
        codec = getattr(config, "codec", None)
        if isinstance(codec, CodecConfig):
            describe_codec(codec)  # it fails where the codec cannot be built, and loads no network
    return configs
