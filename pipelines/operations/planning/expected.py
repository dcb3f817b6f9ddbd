"""What was measured over a sample, as a plan of the whole: bytes, and hours a stage."""

import os
from collections.abc import Mapping
from math import ceil

from pipelines.artifacts.plan_file import Estimate, Plan
from pipelines.operations.planning.forecast import scaled, shifted, sum_of, total_of, wall_share
from pipelines.operations.planning.sample import Measured, MeasuredStage, SourceSizes

_BY_CONTAINER = ("index", "map", "encode")
_BY_SHARD = ("pack", "score")
_WHOLE = ("verify",)
"""Stages whose work grows with the source, by what is divided among workers. The others take as long as over a sample:
`split` deals names, `report` reads a number of clips that does not grow."""
_NOT_GROWING = ("split", "report")
_S_PER_H = 3600.0


def measured_workers(workers: int) -> int:
    """Worker processes of a sample for a run with so many: no more than this machine has cores."""
    return min(workers, os.cpu_count() or 1)


def expected(recipe: str, source: SourceSizes, measured: Measured, workers: int, gpus: int, shard_bytes: int) -> Plan:
    """The plan.

    Args:
        recipe: name of the recipe.
        source: containers of the source.
        measured: what the sample cost, with `measured_workers(workers)`.
        workers: worker processes of the run; each is held to be as fast as one of the sample's.
        gpus: GPUs, of the run as of the sample.
        shard_bytes: bytes of a full shard.
    """
    sizes = [source.size(one) for one in measured.containers]
    everything = sum(source.size(unit.id) for unit in source.units)

    def total(values: Mapping[str, float]) -> Estimate:
        found = [values.get(one, 0.0) for one in measured.containers]
        return total_of(found, sizes, len(source.units), everything)

    clips = total(measured.clip_bytes)
    growth = scaled(clips, 1.0 / sum(measured.clip_bytes.values()))
    bytes_out = scaled(growth, measured.release_bytes)
    hours = {}
    for name, stage in measured.stages.items():
        if name in _BY_CONTAINER:
            rate = stage.unit_seconds / sum(sizes)
            share = wall_share([rate * source.size(unit.id) for unit in source.units], workers)
            seconds = scaled(total(stage.by_container), share)
        elif name in _NOT_GROWING:
            seconds = _certain(stage.seconds - stage.idle_seconds)
        else:
            shards = max(1, ceil(bytes_out.value / shard_bytes)) if name in _BY_SHARD else 1
            seconds = scaled(growth, stage.unit_seconds / min(workers, shards))
        hours[name] = scaled(shifted(seconds, stage.idle_seconds), 1 / _S_PER_H)
    return Plan(
        recipe=recipe,
        source=str(source.root),
        workers=workers,
        measured_workers=measured_workers(workers),
        gpus=gpus,
        containers=len(source.units),
        sampled_containers=len(measured.containers),
        bytes_in=source.size_bytes,
        sampled_bytes=round(sum(sizes)) if source.sizes else 0,
        bytes_out=bytes_out,
        peak_disk_bytes=_peak_disk(measured.stages, growth),
        hours=sum_of(hours.values()),
        stage_hours=hours,
    )


def _peak_disk(stages: Mapping[str, MeasuredStage], growth: Estimate) -> Estimate:
    """Nothing is deleted while a run works, so its folder is largest at its end."""
    return sum_of(
        _certain(stage.folder_bytes) if name in _NOT_GROWING else scaled(growth, stage.folder_bytes)
        for name, stage in stages.items()
    )


def _certain(value: float) -> Estimate:
    return Estimate(value=value, low=value, high=value)
