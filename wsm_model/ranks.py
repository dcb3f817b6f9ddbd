"""One process or many: sharding of the parameters, and sums over the ranks.

With several processes every layer is sharded with FSDP2; alone, the model is left as it is.
"""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.distributed.device_mesh import DeviceMesh, init_device_mesh
from torch.distributed.fsdp import FSDPModule, MixedPrecisionPolicy, fully_shard
from torch.distributed.tensor import DTensor, distribute_tensor

from wsm_data.errors import ConfigError
from wsm_model.config import ModelConfig
from wsm_model.model import Attention, WorldSlamModel
from wsm_model.mot.transformer import parts_in_order
from wsm_model.precision import Precision, matrices


def start_ranks() -> torch.device:
    """Join the processes that torchrun started, if it did, and return this one's device."""
    local = int(os.environ.get("LOCAL_RANK", "0"))
    device = torch.device("cuda", local) if torch.cuda.is_available() else torch.device("cpu")
    if "RANK" in os.environ and not dist.is_initialized():
        if device.type == "cuda":
            torch.cuda.set_device(device)
        dist.init_process_group("nccl" if device.type == "cuda" else "gloo")
    return device


def rank_and_world_size() -> tuple[int, int]:
    """This process's number and how many there are; 0 and 1 alone."""
    return (dist.get_rank(), dist.get_world_size()) if dist.is_initialized() else (0, 1)


def build_model(
    config: ModelConfig, attention: Attention, device: torch.device, *, precision: Precision, shard_ranks: int = 0
) -> WorldSlamModel:
    """A model with random weights, sharded where there are several ranks; its numbers are the same on any number.

    Every rank draws the weights of one part of the model at a time and keeps its share: no host holds a whole model.

    Args:
        config: of the model.
        attention: how its attention is evaluated.
        device: of this rank.
        precision: of its products. In bfloat16 the layers' matrices are gathered rounded, as autocast would round them,
            and their gradients are summed in float32.
        shard_ranks: ranks that weights are sharded over; between groups of so many they are replicated. 0: all.

    Raises:
        ConfigError: the ranks are no multiple of `shard_ranks`.
    """
    _, world_size = rank_and_world_size()
    if world_size == 1:
        return WorldSlamModel(config, attention).to(device)
    with torch.device("meta"):
        model = WorldSlamModel(config, attention)
    _shard(model, rank_mesh(device, shard_ranks), precision)
    model.to_empty(device=device)
    parameters = dict(model.named_parameters())
    for part, module in parts_in_order(config):
        for name, values in module.named_parameters():
            put_share(parameters[f"{part}.{name}"], values.detach(), is_everywhere=True)
    return model


def rank_mesh(device: torch.device, shard_ranks: int = 0) -> DeviceMesh:
    """All ranks in a row, or in rows of `shard_ranks` (HSDP): weights are sharded along a row.

    Raises:
        ConfigError: the ranks do not fill the rows.
    """
    _, world_size = rank_and_world_size()
    if not shard_ranks:
        return init_device_mesh(device.type, (world_size,))
    if world_size % shard_ranks:
        raise ConfigError(f"training.shard_ranks must divide the {world_size} ranks, found {shard_ranks}")
    return init_device_mesh(device.type, (world_size // shard_ranks, shard_ranks), mesh_dim_names=("copy", "shard"))


def _shard(model: WorldSlamModel, mesh: DeviceMesh, precision: Precision) -> None:
    """Every layer is gathered as a whole, its rounded matrices apart from what stays in float32."""
    rounded = {name.rpartition(".")[0] for name in matrices(model)} if precision is Precision.BFLOAT16 else set()
    policy = MixedPrecisionPolicy(param_dtype=torch.bfloat16, reduce_dtype=torch.float32, cast_forward_inputs=False)
    for number, layer in enumerate(model.layers):
        own = [module for name, module in layer.named_modules() if f"layers.{number}.{name}" in rounded]
        if own:
            fully_shard(own, mesh=mesh, mp_policy=policy)
        fully_shard(layer, mesh=mesh)
    fully_shard(model, mesh=mesh)


@torch.no_grad()
def put_share(parameter: Tensor, values: Tensor, *, is_everywhere: bool) -> None:
    """Fill what this rank keeps of a parameter.

    Args:
        parameter: sharded or not.
        values: all of it, of its shape.
        is_everywhere: whether every rank has the values, so that nothing is sent; otherwise the first rank has, and
            what the others give is not looked at.
    """
    if isinstance(parameter, DTensor):
        source = None if is_everywhere else 0
        shared = distribute_tensor(
            values.to(parameter.device, parameter.dtype),
            parameter.device_mesh,
            parameter.placements,
            src_data_rank=source,
        )
        parameter.to_local().copy_(shared.to_local())
    else:
        parameter.copy_(values)


@contextmanager
def whole_model(model: WorldSlamModel) -> Iterator[WorldSlamModel]:
    """The model in evaluation mode with all its weights on every rank, for passes that ranks take by themselves.

    A sharded model is gathered once, tensor by tensor, into another of its kind; one that is alone is lent as it is.
    """
    if not _is_sharded(model):
        was_training = model.training
        try:
            yield model.eval()
        finally:
            model.train(was_training)
        return
    with torch.device("meta"):
        copied = WorldSlamModel(model.config, model.attention)
    copied.load_state_dict({name: whole(one.detach()) for name, one in model.named_parameters()}, assign=True)
    yield copied.eval()


def _is_sharded(model: nn.Module) -> bool:
    return isinstance(model, FSDPModule)


def sum_over_ranks(values: Iterable[float], device: torch.device) -> list[float]:
    """Sums over all ranks, in float64."""
    total = torch.tensor(list(values), dtype=torch.float64, device=device)
    if dist.is_initialized():
        dist.all_reduce(total)
    return [float(value) for value in total.tolist()]


def gather_text(text: str) -> list[str]:
    """What every rank says, in the order of the ranks; each gets the same."""
    if not dist.is_initialized():
        return [text]
    device = collective_device()
    own = torch.tensor(list(text.encode()), dtype=torch.uint8, device=device)
    sizes = [torch.zeros(1, dtype=torch.int64, device=device) for _ in range(dist.get_world_size())]
    dist.all_gather(sizes, torch.tensor([len(own)], device=device))
    longest = max(int(size) for size in sizes)
    padded = [torch.zeros(longest, dtype=torch.uint8, device=device) for _ in sizes]
    dist.all_gather(padded, torch.nn.functional.pad(own, (0, longest - len(own))))
    return [bytes(part[: int(size)].tolist()).decode() for part, size in zip(padded, sizes, strict=True)]


def collective_device() -> torch.device:
    """Where tensors must lie to be exchanged among ranks."""
    return torch.device("cuda", torch.cuda.current_device()) if dist.get_backend() == "nccl" else torch.device("cpu")


def any_rank(here: bool) -> bool:
    """Whether something holds on any rank; every rank gets the same answer."""
    if not dist.is_initialized():
        return here
    return sum_over_ranks([float(here)], collective_device())[0] > 0


def own_part(tensor: Tensor) -> Tensor:
    """What this rank keeps of a tensor; all of it where it is not sharded."""
    part = getattr(tensor, "to_local", None)
    return tensor if part is None else part()


def whole(tensor: Tensor) -> Tensor:
    """A tensor with the parts of all ranks."""
    full = getattr(tensor, "full_tensor", None)
    return tensor if full is None else full()


def wait_for_all() -> None:
    """Return when every rank has come here."""
    if dist.is_initialized():
        dist.barrier()


def leave_ranks() -> None:
    """End this process's part."""
    if dist.is_initialized():
        dist.destroy_process_group()
