"""The RGB expert as a `WanTransformer3DModel` of diffusers, which computes what it computes.

The goal takes the place of the text: its Fourier features are the one text token, and its two layers are the text
embedder's. Queries and keys of the cross-attention, which one token needs none of, are zeros, and the norm before them
is that which changes nothing. The mask of training and the experts of states have no place there.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors.torch import save_file
from torch import Tensor

from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_model.config import Expert, ModelConfig
from wsm_model.model import WorldSlamModel
from wsm_model.weights.wan_names import diffusers_name

WEIGHTS_FILE = "diffusion_pytorch_model.safetensors"
CONFIG_FILE = "config.json"
_FEATURES = 3
"""Coordinates of a goal; each has a sine and a cosine of every frequency beside it."""


def write_diffusers(folder: Path, model: WorldSlamModel) -> None:
    """Write weights and `config.json`, the latter last, in the dtypes that the model has.

    Raises:
        ConfigError: the expert is not as wide as its attention, as every transformer of Wan2.2 is; or it has matrices
            of their own for dreams.
    """
    config = model.config
    if config.own_dream_attention:
        raise ConfigError(
            "a post-trained model dreams with matrices of its own beside those that read what was seen, and a "
            "transformer of diffusers has room for one set; export the model that it was post-trained from"
        )
    if config.generation.width != config.attention_width:
        raise ConfigError(
            f"the RGB expert must be as wide as its attention to be one of Wan2.2's transformers, found widths of "
            f"{config.generation.width} and {config.attention_width}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / CONFIG_FILE).unlink(missing_ok=True)
    save_file(diffusers_tensors(model), folder / WEIGHTS_FILE, metadata={"format": "pt"})
    write_text(folder / CONFIG_FILE, json.dumps(diffusers_config(config), indent=2, sort_keys=True) + "\n")


def diffusers_tensors(model: WorldSlamModel) -> dict[str, Tensor]:
    """Tensors of the RGB expert and the goal by their names in diffusers."""
    marks = (f"experts.{Expert.GENERATION.value}.", "goal.")
    found: dict[str, Tensor] = {}
    for name, parameter in model.named_parameters():
        theirs = diffusers_name(name.replace(marks[0], "")) if any(mark in name for mark in marks) else None
        if theirs is not None:
            found[theirs] = _as_theirs(parameter.detach(), name, model.config)
    return (_unasked(found, model.config) if model.config.goal_tokens == 1 else {}) | found


def diffusers_config(config: ModelConfig) -> dict[str, object]:
    """Settings of the same transformer."""
    return {
        "_class_name": "WanTransformer3DModel",
        "patch_size": [1, config.patch, config.patch],
        "num_attention_heads": config.heads,
        "attention_head_dim": config.head_width,
        "in_channels": config.latent_channels,
        "out_channels": config.latent_channels,
        "text_dim": _FEATURES * (1 + 2 * config.goal_frequencies),
        "freq_dim": config.time_frequencies,
        "ffn_dim": config.generation.feed_forward_width,
        "num_layers": config.layers,
        "cross_attn_norm": True,
        "qk_norm": "rms_norm_across_heads",
        "eps": config.norm_eps,
    }


def _as_theirs(tensor: Tensor, name: str, config: ModelConfig) -> Tensor:
    """The same numbers in their shape: matrices of patches as kernels [D, C, 1, p, p], tables with a leading 1."""
    if name.endswith(".embedding.weight"):
        return tensor.unflatten(1, (config.latent_channels, 1, config.patch, config.patch)).contiguous()
    return tensor.unsqueeze(0).contiguous() if name.endswith("table") else tensor.contiguous()


def _unasked(found: Mapping[str, Tensor], config: ModelConfig) -> dict[str, Tensor]:
    """What attention to one token leaves out: zeros for queries and keys, norms of ones."""
    width, matrix = config.generation.width, found["blocks.0.attn2.to_v.weight"]
    tensors: dict[str, Tensor] = {}
    for number in range(config.layers):
        lead = f"blocks.{number}."
        for part in ("attn2.to_q", "attn2.to_k"):
            tensors[f"{lead}{part}.weight"] = torch.zeros_like(matrix)
            tensors[f"{lead}{part}.bias"] = matrix.new_zeros(width)
        for part in ("attn2.norm_q.weight", "attn2.norm_k.weight", "norm2.weight"):
            tensors[f"{lead}{part}"] = torch.ones(width, device=matrix.device)
        tensors[f"{lead}norm2.bias"] = torch.zeros(width, device=matrix.device)
    return tensors
