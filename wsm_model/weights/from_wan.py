"""The experts from the transformer of Wan2.2-TI2V-5B in a local folder, original or diffusers layout.

Tensors are read one at a time and written straight into the model's parameters: the peak is the model and one tensor.
Nothing is fetched and nothing is unpickled.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn

from wsm_data.errors import ConfigError
from wsm_model.config import Expert
from wsm_model.layers.time_embedding import MODULATIONS
from wsm_model.mot.transformer import MixtureOfTransformers, expert_of_parameter
from wsm_model.ranks import put_share, rank_and_world_size
from wsm_model.weights.interpolation import resize_tensor
from wsm_model.weights.wan_names import is_unused, our_name

_STEM = "diffusion_pytorch_model"


@dataclass(frozen=True, kw_only=True)
class WeightsReport:
    """What became of the model's parameters; names are those of its state dict, sorted.

    Attributes:
        copied: taken over as they are.
        resized: interpolated to another width, with the shapes (from, to).
        new: left as they were initialised.
        unused: tensors of the source that have no place in the model.
    """

    copied: tuple[str, ...]
    resized: Mapping[str, tuple[tuple[int, ...], tuple[int, ...]]]
    new: tuple[str, ...]
    unused: tuple[str, ...]

    def summary(self) -> str:
        """One line of counts."""
        return (
            f"{len(self.copied)} tensors copied, {len(self.resized)} resized, {len(self.new)} new, "
            f"{len(self.unused)} of the source not used"
        )


def load_wan_weights(model: MixtureOfTransformers, folder: str | Path) -> WeightsReport:
    """Fill the experts: generation takes the weights over, depth and pose take them at their own width.

    The first rank reads and resizes one tensor after another, and hands every other its share.

    Args:
        model: on any device but meta; sharded or not.
        folder: the `transformer` folder of the diffusers layout, or the folder of the original checkpoint.

    Raises:
        ConfigError: files are missing or damaged, or the generation expert has other shapes than the weights.
    """
    parameters = dict(model.named_parameters())
    copied: set[str] = set()
    resized: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {}
    unused: set[str] = set()
    rank, _ = rank_and_world_size()
    for name, tensor in _tensors(Path(folder), is_read=rank == 0):
        inner = None if is_unused(name) else our_name(name)
        targets = [] if inner is None else _targets(parameters, inner)
        if not targets:
            unused.add(name)
        for target in targets:
            source = _as_ours(tensor, inner or "")
            if _shape(parameters[target]) == _shape(source):
                copied.add(target)
            else:
                _require_width_of_state_expert(target, source, parameters[target], name)
                resized[target] = (_shape(source), _shape(parameters[target]))
            _write(parameters[target], source, target)
    _require_whole(parameters, copied | set(resized), Path(folder))
    return WeightsReport(
        copied=tuple(sorted(copied)),
        resized=dict(sorted(resized.items())),
        new=tuple(sorted(set(parameters) - copied - set(resized))),
        unused=tuple(sorted(unused)),
    )


def _targets(parameters: Mapping[str, nn.Parameter], inner: str) -> list[str]:
    names = [inner.format(expert=expert.value) for expert in Expert]
    return [name for name in names if name in parameters and not _is_pose_interface(name)]


def _is_pose_interface(name: str) -> bool:
    """The pose expert's embedding and head see poses, not patches: there is nothing to take over."""
    return name.startswith((f"experts.{Expert.POSE.value}.embedding", f"experts.{Expert.POSE.value}.head"))


def _as_ours(tensor: Tensor, inner: str) -> Tensor:
    """The same numbers in our shape: patch kernels [D, C, 1, p, p] as matrices, tables without their leading 1."""
    if inner.endswith(".embedding.weight"):
        return tensor.flatten(1)
    return tensor.squeeze(0) if inner.endswith("table") else tensor


def _write(parameter: nn.Parameter, source: Tensor, name: str) -> None:
    target_shape = _shape(parameter)
    if source.is_meta:  # another rank has the values
        source = torch.empty(target_shape, device=parameter.device)
    if _shape(source) != target_shape:
        if ".time.projection." in name:  # six vectors side by side: each is resized by itself
            parts = source.unflatten(0, (MODULATIONS, -1))
            wanted = (MODULATIONS, target_shape[0] // MODULATIONS, *target_shape[1:])
            source = resize_tensor(parts, wanted, 2 if len(wanted) == 3 else None).flatten(0, 1)
        else:
            source = resize_tensor(source, target_shape, 1 if name.endswith("weight") and source.dim() == 2 else None)
    put_share(parameter, source, is_everywhere=False)


def _require_width_of_state_expert(target: str, source: Tensor, parameter: nn.Parameter, name: str) -> None:
    if expert_of_parameter(target) is Expert.GENERATION:
        raise ConfigError(
            f"the generation expert takes Wan2.2's weights as they are: {name} must have the shape "
            f"{_shape(parameter)}, found {_shape(source)}; choose the model size of the weights"
        )


def _require_whole(parameters: Mapping[str, nn.Parameter], filled: set[str], folder: Path) -> None:
    own = {name for name in parameters if expert_of_parameter(name) is Expert.GENERATION}
    missing = sorted(own - filled)
    if missing:
        raise ConfigError(
            f"{folder} must hold every tensor of Wan2.2's transformer, but there is none for {missing[0]}"
            + (f" and {len(missing) - 1} more" if len(missing) > 1 else "")
            + "; fetch the folder again"
        )


def _tensors(folder: Path, *, is_read: bool) -> Iterator[tuple[str, Tensor]]:
    """Tensors by name; of those that are not read the shape alone."""
    for path in _files(folder):
        try:
            with safe_open(path, framework="pt") as file:
                for name in file.keys():  # noqa: SIM118 - safe_open is no mapping
                    if is_read:
                        yield name, file.get_tensor(name)
                    else:
                        yield name, torch.empty(file.get_slice(name).get_shape(), device="meta")
        except (SafetensorError, OSError) as error:
            raise ConfigError(f"{path} must be a whole safetensors file, but: {error}; fetch it again") from error


def _files(folder: Path) -> list[Path]:
    index = folder / f"{_STEM}.safetensors.index.json"
    single = folder / f"{_STEM}.safetensors"
    if index.is_file():
        try:
            names = sorted(set(json.loads(index.read_text())["weight_map"].values()))
        except (ValueError, KeyError, AttributeError) as error:
            raise ConfigError(f"{index} must list the shards under weight_map; fetch it again") from error
        unsafe = [name for name in names if not isinstance(name, str) or Path(name).name != name]
        if unsafe:
            raise ConfigError(f"{index} must name files of its own folder, found {unsafe[0]!r}")
        return [folder / name for name in names]
    if single.is_file():
        return [single]
    raise ConfigError(
        f"{folder} must hold {single.name} or {index.name}; give the transformer folder of Wan2.2-TI2V-5B"
    )


def _shape(tensor: Tensor) -> tuple[int, ...]:
    return tuple(tensor.shape)
