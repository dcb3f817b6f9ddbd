"""What a step of training takes by calculation: memory of a rank by part, operations, seconds.

One layer and the ends of the model are passed over with tensors that have shapes and no content: what autograd keeps of
them and the operations of their products are those of torch itself, and both grow with the latents. Attention is
counted by the pairs that its mask allows.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import torch
from torch import Tensor
from torch._subclasses.fake_tensor import FakeTensorMode
from torch.nn.functional import scaled_dot_product_attention
from torch.utils.flop_counter import FlopCounterMode

from wsm_data.schema.sequence import SequenceSpan, chunk_bounds
from wsm_model.config import Expert, ModelConfig
from wsm_model.inputs import ModelInputs
from wsm_model.model import WorldSlamModel
from wsm_model.mot.attention import Attended, JointTokens, flatten_tokens, unflatten_tokens
from wsm_model.mot.mask import RULES, Rule, TokenKind
from wsm_model.precision import Precision, autocast, matrices

_TRACED_LATENTS = 4
_CHUNK_SIZES = (1, 2, 3, 4)
_GIB = 2.0**30
_FORWARD, _BACKWARD = 2, 5
"""Products over all allowed pairs in flash attention: scores and sums; backward the scores again and four gradients."""


@dataclass(frozen=True, kw_only=True)
class HardwareConfig:
    """What a run is planned for.

    Attributes:
        gpus: ranks.
        memory_gib: of one GPU (80 GB cards have 79.6 GiB or less).
        peak_tflops: of matrix products, dense (989: bfloat16 on an H100 SXM).
        efficiency: share of the peak that a step is taken to reach, communication and waits included.
        reserve_gib: of one GPU for CUDA, NCCL, and what the allocator cannot use.
    """

    gpus: int = 8
    memory_gib: float = 79.0
    peak_tflops: float = 989.0
    efficiency: float = 0.35
    reserve_gib: float = 4.0

    def __post_init__(self) -> None:
        if self.gpus < 1 or not 0 < self.efficiency <= 1:
            raise ValueError(f"gpus must be at least 1 and efficiency lie in (0, 1], found {self}")
        if not 0 <= self.reserve_gib < self.memory_gib or not self.peak_tflops > 0:
            raise ValueError(f"memory_gib must exceed reserve_gib, and peak_tflops be above 0, found {self}")


@dataclass(frozen=True, kw_only=True)
class PassCost:
    """A teacher-forced pass over one latent.

    Attributes:
        kept_bytes: what autograd keeps for the backward pass, weights left out.
        flop: of matrix products, without attention.
    """

    kept_bytes: float
    flop: float


@dataclass(frozen=True, kw_only=True)
class ModelCost:
    """Costs of a latent, and sizes.

    Attributes:
        layer: one layer.
        ends: what is before and after the layers.
        parameters: all.
        layer_parameters: of one layer.
    """

    layer: PassCost
    ends: PassCost
    parameters: int
    layer_parameters: int


@cache
def model_cost(config: ModelConfig, precision: Precision) -> ModelCost:
    """Pass over a model of one layer and of two: the difference is a layer."""
    (one, small), (two, large) = (_traced(replace(config, layers=layers), precision) for layers in (1, 2))
    layer = PassCost(kept_bytes=two.kept_bytes - one.kept_bytes, flop=two.flop - one.flop)
    ends = PassCost(kept_bytes=one.kept_bytes - layer.kept_bytes, flop=one.flop - layer.flop)
    of_layer = large - small
    return ModelCost(
        layer=layer, ends=ends, parameters=small + (config.layers - 1) * of_layer, layer_parameters=of_layer
    )


def memory_bytes(
    config: ModelConfig,
    cost: ModelCost,
    hardware: HardwareConfig,
    precision: Precision,
    *,
    latents: int,
    is_recomputed: bool,
) -> dict[str, float]:
    """Memory of a rank by part, where it is largest: in the backward pass of the last layer.

    Args:
        config: the model.
        cost: of `model_cost`.
        hardware: over whose GPUs weights, gradients and moments are sharded.
        precision: of the products.
        latents: of all rows that are passed at once, padding included.
        is_recomputed: whether layers are recomputed in the backward pass.
    """
    share = 1 / hardware.gpus
    is_rounded = precision is Precision.BFLOAT16
    copied = cost.layer_parameters if is_recomputed else cost.parameters
    # autocast's copies live as long as a layer's activations
    whole = 2 * copied if is_rounded else 0
    if hardware.gpus > 1:
        # two layers are gathered at a time, rounded: nothing is left to copy; the gradients of one are whole, and
        # packed in float32 to be summed
        gathered = 2 if is_rounded else 4
        whole = cost.layer_parameters * (2 * gathered + gathered + 4)
    kept = _stream_bytes(config, precision) if is_recomputed else cost.layer.kept_bytes
    return {
        "weights, float32": 4 * cost.parameters * share,
        "gradients, float32": 4 * cost.parameters * share,
        "moments of AdamW": 8 * cost.parameters * share,
        "weights of layers at work": float(whole),
        "activations that are kept": latents * (config.layers * kept + cost.ends.kept_bytes),
        "one layer in the backward pass": 2 * latents * cost.layer.kept_bytes,
        "reserve": hardware.reserve_gib * _GIB,
    }


def step_flop(config: ModelConfig, cost: ModelCost, lengths: Mapping[int, float], *, is_recomputed: bool) -> float:
    """Operations of a step: forward, backward, and the layers forward again where they are recomputed.

    Args:
        config: the model.
        cost: of `model_cost`.
        lengths: sequences of a step by their latents; chunk sizes are drawn alike.
        is_recomputed: whether layers are recomputed.
    """
    passes = 4 if is_recomputed else 3
    of_latent = passes * config.layers * cost.layer.flop + 3 * cost.ends.flop
    of_pair = 2 * config.attention_width * config.layers * (_BACKWARD + _FORWARD * (passes - 2))
    return sum(
        count * (latents * of_latent + of_pair * attended_pairs(config, latents)) for latents, count in lengths.items()
    )


def attended_pairs(config: ModelConfig, latents: int) -> float:
    """Pairs of tokens that the mask allows in a sequence, the mean over the chunk sizes 1 to 4."""
    return sum(pairs_of_sequence(config, latents, size) for size in _CHUNK_SIZES) / len(_CHUNK_SIZES)


def pairs_of_sequence(config: ModelConfig, latents: int, chunk_size: int) -> int:
    """Pairs of tokens that the mask allows in a sequence: of frames by each rule, times the tokens of both."""
    bounds = chunk_bounds(latents, chunk_size)
    frames = {
        Rule.UP_TO_OWN_LATENT: latents * (latents + 1) // 2,
        Rule.EARLIER_CHUNKS: sum((end - first) * first for first, end in bounds),
        Rule.UP_TO_OWN_CHUNK: sum((end - first) * end for first, end in bounds),
        Rule.OWN_CHUNK: sum((end - first) ** 2 for first, end in bounds),
    }
    return sum(
        frames[rule] * _tokens(config, query) * _tokens(config, key)
        for (query, key), rule in RULES[config.variant].items()
    )


def _tokens(config: ModelConfig, kind: TokenKind) -> int:
    if kind in (TokenKind.CLEAN_RGB, TokenKind.NOISY_RGB):
        return config.tokens[Expert.GENERATION]
    return sum(config.tokens[expert] for expert in config.state_experts)


def _stream_bytes(config: ModelConfig, precision: Precision) -> int:
    """Tokens of a latent between two layers, clean and prediction; those of poses are float32."""
    rounded = 2 if precision is Precision.BFLOAT16 else 4
    return sum(
        2 * config.tokens[expert] * config.expert(expert).width * (4 if expert is Expert.POSE else rounded)
        for expert in config.experts
    )


def _traced(config: ModelConfig, precision: Precision) -> tuple[PassCost, int]:
    """Costs of a latent in a whole pass, and the parameters."""
    with FakeTensorMode(allow_non_fake_inputs=True):
        model = WorldSlamModel(config)
        rounded = matrices(model) if precision is Precision.BFLOAT16 else set()
        for name, parameter in model.named_parameters():
            if name in rounded:
                parameter.data = parameter.data.bfloat16()  # as sharding hands them out: autocast keeps no copy
        kept, pack = _kept_storages(model)
        with (
            autocast(precision, torch.device("cpu")),
            torch.autograd.graph.saved_tensors_hooks(pack, lambda packed: packed),
            FlopCounterMode(display=False) as counter,
        ):
            _whole_pass(model)
        flop = sum(count for name, count in counter.get_flop_counts()["Global"].items() if "attention" not in str(name))
        count = sum(parameter.numel() for parameter in model.parameters())
    return PassCost(kept_bytes=sum(kept.values()) / _TRACED_LATENTS, flop=flop / _TRACED_LATENTS), count


def _kept_storages(model: WorldSlamModel) -> tuple[dict[int, int], Callable[[Tensor], Tensor]]:
    """Bytes of what autograd keeps, each storage once and no parameter, and the hook that fills them in."""
    weights = {parameter.untyped_storage()._cdata for parameter in model.parameters()}
    kept: dict[int, int] = {}

    def pack(tensor: Tensor) -> Tensor:
        storage = tensor.untyped_storage()
        if storage._cdata not in weights:
            kept[storage._cdata] = storage.nbytes()
        return tensor

    return kept, pack


def _whole_pass(model: WorldSlamModel) -> None:
    config = model.config
    latents = torch.zeros(1, _TRACED_LATENTS, config.latent_channels, config.latent_height, config.latent_width)
    inputs = ModelInputs(
        rgb=latents,
        depth=latents,
        poses=torch.zeros(1, _TRACED_LATENTS, config.pose_slots, 7),
        goal_camera0_m=torch.zeros(1, 3),
        noisy_rgb=latents,
        flow_time=torch.zeros(1, _TRACED_LATENTS),
        spans=(SequenceSpan(row=0, start=0, length=_TRACED_LATENTS, chunk_size=1),),
    )
    streams = model.training_streams(inputs, inputs.table)
    done = model.run(streams, _attend_everywhere, model.goal_context(inputs.goal_camera0_m, inputs.table))
    for expert in config.experts:
        model.expert(expert).read(done[expert])


def _attend_everywhere(_layer: int, tokens: JointTokens) -> Attended:
    """Attention without a mask keeps what attention with one keeps: queries, keys, values, results, and their norms."""
    queries, keys, values = (flatten_tokens([part[i] for part in tokens.values()]) for i in range(3))
    return unflatten_tokens(scaled_dot_product_attention(queries, keys, values), tokens)
