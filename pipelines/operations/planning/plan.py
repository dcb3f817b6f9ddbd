"""`wsm plan`: what a run over a source will cost, from a sample of it that is run on this machine."""

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import typer

from pipelines.artifacts.codec_servers import require_gpus
from pipelines.artifacts.plan_file import Estimate, Plan, write_plan
from pipelines.operations.planning.expected import expected, measured_workers
from pipelines.operations.planning.sample import draw, run_sample, source_sizes
from pipelines.recipe import load_recipe, stage_config
from pipelines.running.options import RunOptions, StageRequest
from pipelines.running.settings import merge, parse_assignments
from pipelines.running.upstream import UpstreamMissing
from wsm_data.errors import ConfigError
from wsm_data.files.json_values import to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.view.drawing.text_table import aligned

_NEEDED = {"index", "encode", "pack"}


def show_plan(source: str, recipe: str, request: StageRequest, share: float, work: Path | None, as_json: bool) -> None:
    """Make a plan, keep it in the folder of the run where one is given, and print it.

    Raises:
        ConfigError: as `make_plan`.
    """
    plan = make_plan(source, recipe, request, share, work)
    if request.out is not None:
        request.out.mkdir(parents=True, exist_ok=True)
        write_plan(request.out, plan)
    typer.echo(canonical_json(to_json(plan)) if as_json else plan_text(plan))


def make_plan(source: str, recipe: str, request: StageRequest, share: float, work: Path | None) -> Plan:
    """Run a sample of a source in a folder that is deleted afterwards, and say what the whole will cost.

    The smallest container of the sample is run first and not counted: what is loaded and compiled once is no part of
    what every further container costs.

    Args:
        source: the source tree.
        recipe: name or path of the recipe that would be run over it.
        request: settings, workers and GPUs of the run that is planned.
        share: share of the source that is run, in (0, 1].
        work: folder in which the sample is run; that of the system for temporary files where there is none.

    Raises:
        ConfigError: a setting is wrong, there is no such source, or the recipe reads none or makes no release.
        UpstreamMissing: nothing in the sample can be used.
    """
    changes = merge(parse_assignments(request.assignments), {"source": source})
    loaded = load_recipe(recipe, request.config, changes)
    if "synth" in loaded.stages or not set(loaded.stages) >= _NEEDED:
        raise ConfigError(f"a plan is of a recipe that turns a source into a release, which {recipe} does not")
    workers, gpus = request.options.processes, request.options.gpus
    options = RunOptions(workers=measured_workers(workers), gpus=gpus, quiet=True, max_refused=float("inf"))
    with TemporaryDirectory(prefix="wsm-plan-", dir=work) as folder:
        encode: Any = stage_config(loaded, "encode", Path(folder))
        pack: Any = stage_config(loaded, "pack", Path(folder))
        if gpus:
            require_gpus(encode.codec, gpus)
        sizes = source_sizes(loaded, Path(folder))
        units = draw(sizes, share)
        typer.echo(f"plan: {len(units)} of {len(sizes.units)} containers are run", err=True)
        smallest = min(units, key=lambda unit: sizes.size(unit.id))
        with suppress(UpstreamMissing):  # nothing in this one can be used
            run_sample(loaded, [smallest], Path(folder) / "first", options)
        measured = run_sample(loaded, units, Path(folder) / "sample", options)
    return expected(recipe, sizes, measured, workers, gpus, pack.shard_mib << 20)


def plan_text(plan: Plan) -> str:
    """The plan as an aligned table, with what it rests on."""
    rows = [("what", "expected", "least", "most")]
    rows += [(f"{name}, hours", *_hours(one)) for name, one in plan.stage_hours.items()]
    rows += [("all stages, hours", *_hours(plan.hours))]
    rows += [("release, bytes", *_bytes(plan.bytes_out)), ("disk at its peak, bytes", *_bytes(plan.peak_disk_bytes))]
    measured = f"measured with {plan.measured_workers}" if plan.measured_workers != plan.workers else "measured so"
    return "\n".join(
        [
            aligned(rows, right=(1, 2, 3)),
            f"source: {plan.bytes_in:,} bytes in {plan.containers:,} containers, of which {plan.sampled_containers:,} "
            f"with {plan.sampled_bytes:,} bytes were run",
            f"workers: {plan.workers} ({measured}), GPUs: {plan.gpus}",
            "least and most bound 90 % of what containers like these give; what else this machine does is in neither",
        ]
    )


def _hours(one: Estimate) -> tuple[str, str, str]:
    return f"{one.value:.3g}", f"{one.low:.3g}", f"{one.high:.3g}"


def _bytes(one: Estimate) -> tuple[str, str, str]:
    return f"{one.value:,.0f}", f"{one.low:,.0f}", f"{one.high:,.0f}"
