"""Which engine runs the batches: by name, loaded when it is asked for."""

import importlib.util
import shutil
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from functools import partial
from math import inf
from typing import Protocol

from pipelines.running.engines.slurm_config import SlurmConfig
from pipelines.running.engines.task import ResultT, TaskT
from wsm_data.errors import ConfigError

_ATTEMPTS = 3
"""Of a task whose local worker dies or hangs, as of one that ray or Slurm loses."""


class Engine(Protocol):
    """Who runs the tasks. An engine knows no stage and writes no file; whoever consumes it writes the ledger.

    A task that was lost with the machine it was on may be done again: its results then come again, all or some.
    """

    def __call__(
        self, tasks: Sequence[TaskT], work: Callable[[TaskT], Iterator[ResultT]], workers: int, /
    ) -> Generator[ResultT, None, None]:
        """Apply `work` to every task with so many workers; results come in no particular order across tasks."""


class EngineName(StrEnum):
    """Who runs the batches."""

    LOCAL = "local"
    RAY = "ray"
    SLURM = "slurm"


@contextmanager
def opened(name: str, slurm: SlurmConfig | None = None, unit_timeout_s: float = 0.0) -> Iterator[Engine]:
    """The engine of a name, for all stages of a run.

    Args:
        name: the engine.
        slurm: what is asked of Slurm.
        unit_timeout_s: a local worker hangs that settles no unit for so long, s; 0 where they are not watched.

    Raises:
        ConfigError: there is no such engine, its extra is not installed, it cannot work on this machine, or Slurm is
            asked for something and is not the engine.
    """
    if slurm is not None and name != EngineName.SLURM:
        raise ConfigError(f"--slurm is for --engine slurm, found {name}; leave it out")
    if unit_timeout_s and name != EngineName.LOCAL:
        raise ConfigError(f"--unit-timeout is for --engine local, found {name}; Slurm takes --slurm time_min=MINUTES")
    match name:
        case EngineName.LOCAL:
            from pipelines.running.engines.local import run_local

            yield partial(run_local, attempts=_ATTEMPTS, silence_s=unit_timeout_s or inf)
        case EngineName.RAY:
            _require_extra("ray", "ray")
            from pipelines.running.engines.ray import ray_session, run_ray

            with ray_session():
                yield run_ray
        case EngineName.SLURM:
            _require_extra("slurm", "submitit")
            if shutil.which("sbatch") is None:
                raise ConfigError("--engine slurm submits with sbatch, which is not here; run it on a login node")
            from pipelines.running.engines.slurm import run_slurm

            yield partial(run_slurm, config=slurm or SlurmConfig())
        case _:
            raise ConfigError(f"there is no engine {name!r}; engines: {', '.join(EngineName)}")


def _require_extra(extra: str, package: str) -> None:
    if importlib.util.find_spec(package) is None:
        raise ConfigError(f"--engine {extra} needs the package {package}: pip install 'wsm[{extra}]'")
