"""Memory and operations by calculation, beside what a real pass keeps and what can be counted by hand."""

import tomllib
from importlib.resources import files

import pytest
import torch
from torch.autograd.graph import saved_tensors_hooks
from torch.utils.flop_counter import sdpa_backward_flop_count, sdpa_flop_count

from wsm_data.files.typed_toml import build_config
from wsm_data.schema.sequence import frame_table
from wsm_model.mot.mask import dense_mask
from wsm_model.precision import Precision
from wsm_model.presets import PRESETS, preset
from wsm_model.training.budget import HardwareConfig, attended_pairs, memory_bytes, model_cost, step_flop

RECIPES = sorted(files("pipelines.training").joinpath("recipes").iterdir(), key=str)


def kept_by_a_real_pass(model, inputs) -> int:
    """Bytes of storages that autograd keeps, parameters left out."""
    weights = {one.untyped_storage().data_ptr() for one in model.parameters()}
    kept: dict[int, torch.Tensor] = {}

    def pack(tensor: torch.Tensor) -> torch.Tensor:
        if tensor.untyped_storage().data_ptr() not in weights:
            kept[tensor.untyped_storage().data_ptr()] = tensor
        return tensor

    with saved_tensors_hooks(pack, lambda tensor: tensor):
        outputs = model(inputs)
    assert outputs.depth is not None
    return sum(tensor.untyped_storage().nbytes() for tensor in kept.values())


def test_what_a_pass_keeps_is_what_a_real_one_keeps_but_for_the_mask(make_model, make_inputs, make_spans):
    """The real pass runs by blocks, which gather keys anew for each: 12 latents a row leave that within a quarter."""
    model, inputs = make_model(layers=6), make_inputs(make_spans([12] * 3, [1, 1, 1]))
    cost = model_cost(model.config, Precision.FLOAT32)
    calculated = 36 * (6 * cost.layer.kept_bytes + cost.ends.kept_bytes)
    assert calculated == pytest.approx(kept_by_a_real_pass(model, inputs), rel=0.25)
    assert cost.parameters == sum(one.numel() for one in model.parameters())


def test_operations_of_a_layer_are_two_for_each_weight_and_token():
    """Weights of attention and feed-forward of `small`, by hand: 4 D A + 2 D W; and of the goal, once a frame."""
    config = PRESETS["small"]
    by_hand = sum(
        2
        * 2
        * config.tokens[one]
        * config.expert(one).width
        * (4 * config.attention_width + 2 * config.expert(one).feed_forward_width)
        for one in config.experts
    )
    of_goal = 2 * 2 * config.generation.width * config.attention_width
    assert model_cost(config, Precision.BFLOAT16).layer.flop == pytest.approx(by_hand + of_goal, rel=1e-9)


def test_pairs_are_those_of_the_dense_mask(config, make_spans):
    pairs = [int(dense_mask(config, frame_table(make_spans([9], [size]), 1, 9)).sum()) for size in (1, 2, 3, 4)]
    assert attended_pairs(config, 9) == sum(pairs) / 4


def test_attention_takes_what_torch_counts_for_the_pairs_forward_and_backward(config):
    """Beyond three times the products of a pass; recomputing repeats the layers' products and the forward attention."""
    cost, pairs = model_cost(config, Precision.FLOAT32), int(attended_pairs(config, 9))
    queries, keys = (1, config.heads, pairs, config.head_width), (1, config.heads, 1, config.head_width)
    forward = config.layers * sdpa_flop_count(queries, keys, keys)
    backward = config.layers * sdpa_backward_flop_count(queries, queries, keys, keys)
    once, again = (step_flop(config, cost, {9: 1.0}, is_recomputed=one) for one in (False, True))
    products = 9 * (config.layers * cost.layer.flop + cost.ends.flop)
    assert pairs == attended_pairs(config, 9)
    assert once - 3 * products == pytest.approx(forward + backward)
    assert again - once == pytest.approx(9 * config.layers * cost.layer.flop + forward)


@pytest.mark.parametrize(
    ("precision", "gpus", "is_recomputed", "of_a_layer"),
    [
        (Precision.FLOAT32, 1, False, 0),
        (Precision.BFLOAT16, 1, True, 2),  # the rounded weights of the layer at work
        (Precision.FLOAT32, 4, True, 16),  # two layers gathered, gradients of one whole and packed: four of 4 bytes
        (Precision.BFLOAT16, 4, True, 10),  # gathered rounded, as gradients come; they are summed in float32
    ],
)
def test_layers_at_work_hold_rounded_copies_and_what_is_gathered(config, precision, gpus, is_recomputed, of_a_layer):
    cost = model_cost(config, precision)
    hardware = HardwareConfig(gpus=gpus, memory_gib=8.0)
    memory = memory_bytes(config, cost, hardware, precision, latents=10, is_recomputed=is_recomputed)
    assert memory["weights of layers at work"] == of_a_layer * cost.layer_parameters
    assert memory["one layer in the backward pass"] == 2 * 10 * cost.layer.kept_bytes  # values and their gradients


def test_recomputing_costs_a_forward_pass_and_saves_what_layers_keep(config):
    cost, hardware = model_cost(config, Precision.FLOAT32), HardwareConfig(gpus=4, memory_gib=8.0)
    kept, recomputed = (
        memory_bytes(config, cost, hardware, Precision.FLOAT32, latents=100, is_recomputed=again)
        for again in (False, True)
    )
    assert recomputed["activations that are kept"] < 0.2 * kept["activations that are kept"]
    assert kept["moments of AdamW"] == 8 * cost.parameters / 4
    flop = [step_flop(config, cost, {9: 2.0}, is_recomputed=again) for again in (False, True)]
    assert 1.25 < flop[1] / flop[0] < 4 / 3


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda path: path.stem)
def test_packaged_recipes_fit_rows_of_200_latents(recipe):
    values = tomllib.loads(recipe.read_text())
    hardware = build_config(HardwareConfig, values["hardware"])
    config = preset(values["model"]["size"])
    memory = memory_bytes(
        config,
        model_cost(config, Precision.BFLOAT16),
        hardware,
        Precision.BFLOAT16,
        latents=200 * values["training"]["micro_rows"],
        is_recomputed=values["training"]["checkpoint_activations"],
    )
    assert sum(memory.values()) < hardware.memory_gib * 2**30


def test_hardware_that_is_none_is_refused():
    with pytest.raises(ValueError, match="gpus must be at least 1"):
        HardwareConfig(gpus=0)
    with pytest.raises(ValueError, match="must exceed reserve_gib"):
        HardwareConfig(memory_gib=3.0)
