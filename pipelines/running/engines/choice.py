"""Which engine runs the batches: by name, loaded when it is asked for."""

import importlib.util
import shutil
from collections.abc import Callable, Generator, Iterator, Sequence
from enum import StrEnum
from typing import Protocol

from pipelines.running.engines.task import ResultT, TaskT
from wsm_data.errors import ConfigError


class Engine(Protocol):
    """Who runs the tasks. An engine knows no stage and writes no file; whoever consumes it writes the ledger."""

    def __call__(
        self, tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int, /
    ) -> Generator[ResultT, None, None]:
        """Apply `work` to every task with so many workers; results come in no particular order across tasks."""


class EngineName(StrEnum):
    """Who runs the batches."""

    LOCAL = "local"
    RAY = "ray"
    SLURM = "slurm"


def engine(name: str) -> Engine:
    """The engine of a name.

    Raises:
        ConfigError: there is no such engine, its extra is not installed, or it cannot work on this machine.
    """
    match name:
        case EngineName.LOCAL:
            from pipelines.running.engines.local import run_local

            return run_local
        case EngineName.RAY:
            _require_extra("ray", "ray")
            from pipelines.running.engines.ray import run_ray

            return run_ray
        case EngineName.SLURM:
            _require_extra("slurm", "submitit")
            if shutil.which("sbatch") is None:
                raise ConfigError("--engine slurm submits with sbatch, which is not here; run it on a login node")
            from pipelines.running.engines.slurm import run_slurm

            return run_slurm
    raise ConfigError(f"there is no engine {name!r}; engines: {', '.join(EngineName)}")


def _require_extra(extra: str, package: str) -> None:
    if importlib.util.find_spec(package) is None:
        raise ConfigError(f"--engine {extra} needs the package {package}: pip install 'wsm[{extra}]'")
