"""What a step works through, and how fast: latents, tokens and operations a second, and memory.

Operations are those of the model: products of the forward pass and twice as many backward, attention by the pairs that
its mask allows. Layers that are recomputed do not count again: the share of a peak is that of the model (MFU), not that
of the hardware.
"""

import resource
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import nn

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.config import Expert, ModelConfig
from wsm_model.model import WorldSlamModel
from wsm_model.mot.transformer import expert_of_parameter
from wsm_model.training.budget import pairs_of_sequence

_COPIES = 2
_PASSES = 3
"""Forward, and backward twice as much: gradients of inputs and of weights, or of both factors."""
_GIB = 2.0**30


@dataclass(frozen=True, kw_only=True)
class StepWork:
    """What a step works through, over all ranks.

    Attributes:
        latents: of sequences, without padding.
        tokens: clean and prediction tokens of those latents.
        flop: of the model, forward and backward.
    """

    latents: float
    tokens: float
    flop: float


def work_of(model: WorldSlamModel, spans: Sequence[SequenceSpan]) -> StepWork:
    """What some sequences come to."""
    config = model.config
    latents = sum(span.length for span in spans)
    pairs = sum(pairs_of_sequence(config, span.length, span.chunk_size) for span in spans)
    of_pair = 2 * 2 * config.attention_width * config.layers  # scores and sums, of every head
    return StepWork(
        latents=latents,
        tokens=_COPIES * sum(config.tokens.values()) * latents,
        flop=_PASSES * (latents * latent_flop(model) + pairs * of_pair),
    )


def latent_flop(model: WorldSlamModel) -> float:
    """Operations of a latent in a forward pass: two for each weight of a matrix and token that it multiplies.

    The goal's two matrices, which are passed once a sequence, are left out.
    """
    return sum(
        2.0 * module.weight.numel() * _tokens_of_matrix(model.config, name)
        for name, module in model.named_modules()
        if isinstance(module, nn.Linear) and expert_of_parameter(name) is not None
    )


def _tokens_of_matrix(config: ModelConfig, name: str) -> int:
    expert = expert_of_parameter(name) or Expert.GENERATION
    tokens = config.tokens[expert]
    if ".time." in name:
        return _COPIES
    if ".head." in name:
        return tokens
    if ".cross_attention." in name:
        is_asked = name.endswith((".to_k", ".to_v")) or config.goal_tokens == 1
        return config.goal_tokens if is_asked else tokens
    return _COPIES * tokens


def speed(work: StepWork, seconds: float) -> dict[str, float]:
    """What is done in a second, all ranks together."""
    return {
        "latents_per_second": work.latents / seconds,
        "tokens_per_second": work.tokens / seconds,
        "tflop_per_second": work.flop / seconds / 1e12,
    }


def peak_memory_gib() -> float:
    """Most memory that this process has held so far: of the GPU where there is one, otherwise of the machine."""
    if torch.cuda.is_available():
        return torch.cuda.max_memory_allocated() / _GIB
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / _GIB
