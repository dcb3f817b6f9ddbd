"""LoRA on the attention of dreams (peft): one adapter that is trained, and one that follows it, the old policy.

The pretrained policy is the model with both switched off. What was seen passes through matrices without adapters, so
the SLAM expert, and its memory, stay as they were to the bit.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import cast

import torch
from peft import LoraConfig, PeftModel, get_peft_model, get_peft_model_state_dict
from safetensors.torch import save_file
from torch import Tensor, nn

from wsm_data.files.atomic import write_text
from wsm_model.model import WorldSlamModel
from wsm_model.posttraining.config import AdapterConfig
from wsm_model.posttraining.dream_attention import with_dream_attention

ADAPTER_WEIGHTS = "adapter_model.safetensors"
ADAPTER_CONFIG = "adapter_config.json"
_TARGETS = r"layers\.\d+\.experts\.generation\.dream_attention\.to_(q|k|v|out)"
_MARK = "lora_"


class Policy(StrEnum):
    """Whose velocity is asked for; the values are the names of adapters in peft."""

    TRAINED = "default"
    OLD = "old"


class AdaptedModel:
    """A frozen model with the two adapters, equal at first, and computing what the model computes.

    Args:
        model: pretrained; its weights are shared.
        config: size of the adapters. Their first matrices are drawn by torch's generator.

    Attributes:
        model: what is run.
        kept: the adapters' weights, those of the trained one with gradients.
    """

    def __init__(self, model: WorldSlamModel, config: AdapterConfig):
        self.model = with_dream_attention(model).requires_grad_(False).eval()
        self._config = LoraConfig(
            r=config.rank, lora_alpha=config.alpha, target_modules=_TARGETS, init_lora_weights="gaussian"
        )
        self._peft: PeftModel = get_peft_model(cast(nn.Module, self.model), self._config)
        self._peft.add_adapter(Policy.OLD.value, self._config)
        self._choose(Policy.TRAINED)
        self.follow(0.0)
        self.kept = nn.Module()
        for name, parameter in self.model.named_parameters():
            if _MARK in name:
                self.kept.register_parameter(name.replace(".", "/"), parameter)

    def trained(self) -> list[nn.Parameter]:
        """Parameters that learn."""
        return [parameter for name, parameter in self._weights(Policy.TRAINED)]

    @torch.no_grad()
    def follow(self, decay: float) -> None:
        """Old policy = decay times itself + (1 - decay) times the trained one."""
        for (_, old), (_, new) in zip(self._weights(Policy.OLD), self._weights(Policy.TRAINED), strict=True):
            old.lerp_(new, 1 - decay)

    @contextmanager
    def acting(self, policy: Policy) -> Iterator[WorldSlamModel]:
        """The model under a policy. Outside of all contexts it is the trained one."""
        self._choose(policy)
        try:
            yield self.model
        finally:
            self._choose(Policy.TRAINED)

    @contextmanager
    def pretrained(self) -> Iterator[WorldSlamModel]:
        """The model without adapters."""
        with self._peft.disable_adapter():
            yield self.model
        self._choose(Policy.TRAINED)

    def save(self, folder: Path) -> None:
        """Write the trained adapter as peft does: `adapter_model.safetensors`, and `adapter_config.json`, the last."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ADAPTER_CONFIG).unlink(missing_ok=True)
        tensors: dict[str, Tensor] = get_peft_model_state_dict(self._peft, adapter_name=Policy.TRAINED.value)
        save_file(
            {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}, folder / ADAPTER_WEIGHTS
        )
        stated = {name: value for name, value in asdict(self._config).items() if value is not None}
        stated.pop("runtime_config", None)  # of this process
        text = json.dumps(stated | {"inference_mode": True}, indent=2, sort_keys=True, default=str)
        write_text(folder / ADAPTER_CONFIG, text + "\n")

    def merged(self) -> WorldSlamModel:
        """The model with the trained adapter in its matrices; afterwards there are no adapters any more."""
        return cast(WorldSlamModel, self._peft.merge_and_unload(adapter_names=[Policy.TRAINED.value])).requires_grad_(
            True
        )

    def _choose(self, policy: Policy) -> None:
        """Switch to an adapter; peft then asks gradients of it, and of no other one."""
        self._peft.set_adapter(policy.value)
        for _, parameter in self._weights(Policy.OLD):
            parameter.requires_grad_(False)

    def _weights(self, policy: Policy) -> list[tuple[str, nn.Parameter]]:
        return [
            (name, parameter)
            for name, parameter in self.model.named_parameters()
            if _MARK in name and f".{policy.value}." in name
        ]
