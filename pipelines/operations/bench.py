"""`wsm bench loader`: what a loader delivers on this machine, what holds it up, and what to change."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import typer

from pipelines.running.settings import merge, parse_assignments
from wsm_data.files.typed_toml import build_config
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.doctor.diagnosis import LoaderRun, cautions, diagnose, readers
from wsm_data.loaders.doctor.examine import examine
from wsm_data.loaders.timing import Part
from wsm_data.view.drawing.text_table import aligned

SWEPT_THREADS = (1, 2, 4)
_PARTS = {
    Part.STORE: "reading from the store",
    Part.CHECKSUM: "comparing checksums",
    Part.COLLATE: "making batches, standardising",
    Part.TRANSFER: "copying to the device",
}


@dataclass(frozen=True, kw_only=True)
class _Settings:
    """What `--set` changes: sections of a loader's settings."""

    source: SourceConfig
    order: OrderConfig = field(default_factory=OrderConfig)
    read: ReadConfig = field(default_factory=ReadConfig)
    depth: bool = True


def bench_loader(
    release: str, assignments: Sequence[str], batches: int, seconds: float, step_s: float, ranks: int, sweep: bool
) -> None:
    """Print what a loader of a release does, where its time goes, and what to do about it.

    Args:
        release: folder or URL.
        assignments: `--set` words with the sections source, order and read.
        batches: batches to take at most.
        seconds: when to stop, s.
        step_s: time that a training step takes, s; 0 takes batches as fast as they come.
        ranks: ranks of the training run; the loader of rank 0 is measured.
        sweep: compare some numbers of threads too.

    Raises:
        ConfigError: the settings are wrong, or there is no such release.
    """
    values = merge({"source": {"release": release}}, parse_assignments(assignments))
    settings = build_config(_Settings, values)
    config = LoaderConfig(sources=(settings.source,), order=settings.order, read=settings.read, depth=settings.depth)
    run, facts = examine(config, batches=batches, seconds=seconds, step_s=step_s, ranks=ranks)
    typer.echo(describe(run, config.read, ranks))
    typer.echo(f"\n{diagnose(run, config.read)}")
    for caution in cautions(facts, config.order):
        typer.echo(f"warning: {caution}")
    if sweep:
        typer.echo(f"\n{_sweep(config, batches, seconds, ranks)}")


def describe(run: LoaderRun, read: ReadConfig, ranks: int) -> str:
    """The table of a run: rates, and where the time went."""
    limit = "one stream from the store" if run.remote else "one thread into one buffer"
    rates = aligned(
        [
            ["measured" if ranks == 1 else f"measured on rank 0 of {ranks}", "", ""],
            ["samples", f"{run.clips / run.elapsed_s:,.1f}", f"clips/s, {run.clips} in {run.elapsed_s:.1f} s"],
            ["bytes", f"{run.bytes_per_s / 1e6:,.0f}", "MB/s as stored"],
            ["limit", f"{run.limit_bytes_per_s / 1e6:,.0f}", f"MB/s, {limit}, the same clips"],
            ["first batch", f"{1000 * run.first_batch_s:,.0f}", "ms, opening included"],
        ],
        right=[1],
    )
    of_all = readers(read) * run.elapsed_s
    parts = [[text, f"{run.seconds[part]:.2f}", f"{run.seconds[part] / of_all:.0%}"] for part, text in _PARTS.items()]
    header = [f"time of {readers(read)} {'threads' if read.threads else 'caller'}", "s", "share"]
    waited = run.seconds[Part.WAIT]
    rows = [header, *parts, ["the consumer waited", f"{waited:.2f}", f"{waited / run.elapsed_s:.0%}"]]
    return f"{rates}\n\n{aligned(rows, right=[1, 2])}"


def _sweep(config: LoaderConfig, batches: int, seconds: float, ranks: int) -> str:
    """The same with other numbers of threads, one after the other."""
    rows = [["threads", "clips/s", "MB/s", "first batch, ms"]]
    for threads in SWEPT_THREADS:
        read = replace(config.read, threads=threads)
        run, _ = examine(replace(config, read=read), batches=batches, seconds=seconds, ranks=ranks)
        rows.append(
            [
                str(threads),
                f"{run.clips / run.elapsed_s:,.1f}",
                f"{run.bytes_per_s / 1e6:,.0f}",
                f"{1000 * run.first_batch_s:,.0f}",
            ]
        )
    return aligned(rows, right=range(4))
