"""The engine that a command line asks for."""

from contextlib import AbstractContextManager

from pipelines.running.engines.choice import Engine, opened
from pipelines.running.engines.slurm_config import SlurmConfig
from pipelines.running.options import StageRequest
from pipelines.running.settings import parse_assignments
from wsm_data.files.typed_toml import build_config


def engine_of(request: StageRequest) -> AbstractContextManager[Engine]:
    """The engine, open for all that is run in it.

    Raises:
        ConfigError: when it is opened: it cannot work here, or is asked for what there is not.
    """
    slurm = build_config(SlurmConfig, parse_assignments(request.slurm), "slurm") if request.slurm else None
    return opened(request.engine, slurm, request.unit_timeout)
