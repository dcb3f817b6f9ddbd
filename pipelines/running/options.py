"""What a command line asks of stages, beside their settings. Light: the command line takes its defaults from here."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.running.engines.choice import EngineName
from wsm_data.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What to run now. None of it is a setting: none of it changes the bytes of a unit.

    Attributes:
        workers: worker processes; 0 for one a core.
        gpus: GPUs of this machine, each with a loaded codec that the workers share; 0 where each worker has its own.
        limit: at most this many pending units; 0 for all.
        only: patterns of unit ids (`gibson_*/*`); empty for all.
        dry_run: list what would be done and stop.
        max_refused: what may be refused. Below 1 a share: of the listed units, and by itself of the parts that were
            found in them (trajectories in a container), which is known when all selected units are settled. From 1 on
            a number: of refused units and refused parts together. What `finish` refuses counts as parts.
        fork: when the settings differ from those in the folder, use a folder beside it instead of stopping.
        retry_refused: try refused units again although neither their input nor the settings changed.
        retry_reasons: try units again of which something was refused for one of these reasons.
        reclaim: give up what nothing needs any more (the clips of a shard that is written) while the stage works.
        quiet: neither a bar nor a line a unit.
        verbose: a line a unit where there would be a bar, and what else is worth knowing.
    """

    workers: int = 1
    gpus: int = 0
    limit: int = 0
    only: tuple[str, ...] = ()
    dry_run: bool = False
    max_refused: float = 0.1
    fork: bool = False
    retry_refused: bool = False
    retry_reasons: tuple[str, ...] = ()
    reclaim: bool = False
    quiet: bool = False
    verbose: bool = False

    @property
    def processes(self) -> int:
        """Number of worker processes on this machine."""
        return self.workers or os.cpu_count() or 1


@dataclass(frozen=True, kw_only=True)
class StageRequest:
    """What a command line asks of one stage, or of the stages of a recipe.

    Attributes:
        out: folder to write; None for the one that is named like the command.
        config: TOML file of differences, with a section per stage.
        assignments: `key=value` words of `--set`.
        engine: who runs the workers.
        slurm: `key=value` words of `--slurm`: what is asked of Slurm.
        unit_timeout: seconds after which a local worker that settled no unit is taken to hang, is killed, and its task
            begun again; 0 for never.
        log_file: file to which a line a unit, warnings, tables and errors are added; None for none.
        options: what to run now.
    """

    out: Path | None = None
    config: Path | None = None
    assignments: tuple[str, ...] = ()
    engine: EngineName = EngineName.LOCAL
    slurm: tuple[str, ...] = ()
    unit_timeout: float = 0.0
    log_file: Path | None = None
    options: RunOptions = field(default_factory=lambda: RunOptions(workers=0))

    def __post_init__(self) -> None:
        if self.options.gpus and self.engine is not EngineName.LOCAL:
            raise ConfigError(
                f"--gpus is of this machine, and --engine {self.engine} works on others; leave --gpus out, or run "
                "with --engine local on a machine with GPUs"
            )
