"""Checkpoints of a run: parameters and moments in safetensors, sharded over the ranks, and a small JSON beside them.

A checkpoint is a folder `step-000500`. Its `state.json` is written last: a folder without it is unfinished and is
passed over. It says the step, the state of the loader and what the tensors must fit, so a run goes on exactly where it
was, on as many ranks as are there now. Files of tensors are vouched for by `digests-00000.json`, one for each rank that
wrote. Nothing is pickled.
"""

import json
import re
import shutil
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn
from torch.distributed.checkpoint.api import CheckpointException
from torch.distributed.checkpoint.hf_storage import HuggingFaceStorageReader, HuggingFaceStorageWriter
from torch.distributed.checkpoint.state_dict_loader import load
from torch.distributed.checkpoint.state_dict_saver import save

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.differences import differences
from wsm_data.files.digest import xxh3_128_file
from wsm_data.files.jsonlines import canonical_json
from wsm_data.files.sealed import sealed, unsealed
from wsm_model.ranks import rank_and_world_size, wait_for_all

_STATE = "state.json"
_FOLDER = re.compile(r"step-(\d{6,})")
_MOMENTS = ("exp_avg", "exp_avg_sq")
_FILE_BYTES = 1 << 30
"""Of a rank, in one file of a checkpoint."""
NOTHING: Mapping[str, Tensor] = MappingProxyType({})
"""Averaged weights of a run that keeps none."""


@dataclass(frozen=True, kw_only=True)
class TrainingState:
    """Where a run stands.

    Attributes:
        step: optimiser steps done.
        loader: state of the loader, as it wrote it.
        identity: what the run is made from: model, settings, release; another run's checkpoints are refused by it.
    """

    step: int
    loader: Mapping[str, object]
    identity: Mapping[str, object]


def save_checkpoint(
    folder: Path,
    model: nn.Module,
    optimiser: torch.optim.Optimizer,
    state: TrainingState,
    average: Mapping[str, Tensor] = NOTHING,
) -> Path:
    """Write a checkpoint; every rank writes its own part, and the last act is one rank's `state.json`.

    Args:
        folder: of the run's checkpoints.
        model: its parameters.
        optimiser: its moments.
        state: where the run stands.
        average: averaged weights by name, where there are any.

    Returns:
        The folder of this step.

    Raises:
        OSError: it could not be written; the folder is no checkpoint then.
        KeyboardInterrupt: likewise.
    """
    rank, world_size = rank_and_world_size()
    path = folder / f"step-{state.step:06d}"
    if rank == 0:
        shutil.rmtree(path, ignore_errors=True)  # what a killed run left
        path.mkdir(parents=True)
    wait_for_all()
    tensors = _tensors(model, optimiser, average)
    writer = HuggingFaceStorageWriter(
        str(path), fqn_to_index_mapping=_files_of(tensors, world_size), save_distributed=True
    )
    with _quiet_alone(), _causes_raised():
        save(tensors, storage_writer=writer, no_dist=world_size == 1)
    wait_for_all()
    own = {file.name: xxh3_128_file(file) for file in sorted(path.glob("*.safetensors"))[rank::world_size]}
    write_text(path / f"digests-{rank:05d}.json", canonical_json(own) + "\n")
    wait_for_all()
    if rank == 0:
        record = {"step": state.step, "loader": dict(state.loader), "identity": dict(state.identity)}
        write_text(path / _STATE, canonical_json(sealed(record)) + "\n")
    wait_for_all()
    return path


def load_checkpoint(
    path: Path,
    model: nn.Module,
    optimiser: torch.optim.Optimizer,
    identity: Mapping[str, object],
    average: Mapping[str, Tensor] = NOTHING,
) -> TrainingState:
    """Fill model, optimiser and averaged weights in place; returns where the run stood.

    Raises:
        ConfigError: the checkpoint is of another model, settings or release; says in which fields.
        IntegrityError: it is damaged.
    """
    state = read_state(path)
    _require_same(path, state.identity, identity)
    _prepare_moments(model, optimiser, state.step)
    fill(path, _tensors(model, optimiser, average), vouched=True)
    return state


def fill(path: Path, tensors: Mapping[str, Tensor], *, vouched: bool) -> None:
    """Read tensors in place from the safetensors files of a folder, each rank what it keeps.

    Args:
        path: the folder; it may hold others too.
        tensors: by their names there.
        vouched: whether it is a checkpoint, whose files have digests that are compared.

    Raises:
        IntegrityError: a file is damaged, or a tensor is not there.
    """
    rank, world_size = rank_and_world_size()
    try:
        if vouched:
            _require_sound(path, rank, world_size)
        reader = HuggingFaceStorageReader(str(path))
        with _quiet_alone():
            load(dict(tensors), storage_reader=reader, no_dist=world_size == 1)
    except (OSError, RuntimeError, KeyError, TypeError, ValueError, CheckpointException) as error:
        thing, advice = ("checkpoint", "delete it to go on from the one before") if vouched else ("model", "restore it")
        raise IntegrityError(f"{path} must be a whole {thing}, but: {_cause(error)}; {advice}") from error


def tensor_names(path: Path) -> set[str]:
    """Names of the tensors of a checkpoint.

    Raises:
        IntegrityError: a file is damaged.
    """
    names: set[str] = set()
    for file in sorted(path.glob("*.safetensors")):
        try:
            with safe_open(file, framework="pt") as opened:
                names |= set(opened.keys())
        except (SafetensorError, OSError) as error:
            raise IntegrityError(f"{file} must be a whole safetensors file, but: {error}") from error
    return names


def _require_sound(path: Path, rank: int, world_size: int) -> None:
    """Every rank compares its share of the files with their digests."""
    digests: dict[str, str] = {}
    for file in path.glob("digests-*.json"):
        digests |= json.loads(file.read_text())
    if unvouched := sorted(file.name for file in path.glob("*.safetensors") if file.name not in digests):
        raise ValueError(f"there is no digest of {', '.join(unvouched)}")
    for name in sorted(digests)[rank::world_size]:
        if xxh3_128_file(path / name) != digests[name]:
            raise ValueError(f"{name} does not have the digest that was written with it")


def read_state(path: Path) -> TrainingState:
    """The JSON of a checkpoint.

    Raises:
        IntegrityError: it is not what `save_checkpoint` writes.
    """
    try:
        record = unsealed(json.loads((path / _STATE).read_text()))
        return TrainingState(step=int(record["step"]), loader=record["loader"], identity=record["identity"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise IntegrityError(f"{path / _STATE} must be the state of a checkpoint, but: {error}") from error


def checkpoints(folder: Path) -> list[Path]:
    """Finished checkpoints of a run, oldest first."""
    found = [(int(match[1]), path) for path in folder.glob("step-*") if (match := _FOLDER.fullmatch(path.name))]
    return [path for _, path in sorted(found) if (path / _STATE).is_file()]


def drop_old_checkpoints(folder: Path, keep: int) -> None:
    """Delete all but the latest; what marks a checkpoint as finished goes first."""
    for path in checkpoints(folder)[:-keep]:
        (path / _STATE).unlink()
        shutil.rmtree(path)


@contextmanager
def _quiet_alone() -> Iterator[None]:
    """Without a word about a single process, which is asked for."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="torch.distributed is disabled", category=UserWarning)
        yield


@contextmanager
def _causes_raised() -> Iterator[None]:
    """Raise what ended a rank, which torch wraps: Ctrl-C, or what the system said, such as no room."""
    try:
        yield
    except CheckpointException as error:
        causes = [cause for cause, _ in error.failures.values()]
        for kind in (KeyboardInterrupt, OSError):
            if found := next((cause for cause in causes if isinstance(cause, kind)), None):
                raise found from None
        raise


def _cause(error: BaseException) -> str:
    """What went wrong, without the tracebacks of all ranks."""
    if not isinstance(error, CheckpointException):
        return str(error)
    return "; ".join(sorted({str(cause) for cause, _ in error.failures.values()}))


def _tensors(model: nn.Module, optimiser: torch.optim.Optimizer, average: Mapping[str, Tensor]) -> dict[str, Tensor]:
    tensors: dict[str, Tensor] = {f"average.{name}": tensor for name, tensor in average.items()}
    for name, parameter in model.named_parameters():  # those that do not learn, too: they have no moments
        tensors[f"model.{name}"] = parameter.detach()
        for moment in _MOMENTS:
            if moment in optimiser.state[parameter]:
                tensors[f"optimiser.{moment}.{name}"] = optimiser.state[parameter][moment]
    return tensors


def _files_of(tensors: Mapping[str, Tensor], world_size: int) -> dict[str, int]:
    """The file of each tensor, from 1: a rank holds copies of one file's content while it writes, not of everything."""
    files: dict[str, int] = {}
    number, filled = 1, 0
    for name, tensor in tensors.items():
        size = tensor.numel() * tensor.element_size() // world_size
        if filled and filled + size > _FILE_BYTES:
            number, filled = number + 1, 0
        files[name], filled = number, filled + size
    return files


def _prepare_moments(model: nn.Module, optimiser: torch.optim.Optimizer, step: int) -> None:
    """Give the optimiser the state it has after `step` steps, for the moments to be read into."""
    for parameter in (one for one in model.parameters() if one.requires_grad):
        moments = {moment: torch.zeros_like(parameter) for moment in _MOMENTS}
        count = torch.tensor(float(step), device=parameter.device)  # where a fused step looks for it
        optimiser.state[parameter] = {"step": count, **moments} if step else {}


def _require_same(path: Path, found: Mapping[str, object], wanted: Mapping[str, object]) -> None:
    if lines := differences(found, wanted):
        raise ConfigError(
            "\n  ".join([f"{path} belongs to another run; give another --out, or the same settings:", *lines])
        )
