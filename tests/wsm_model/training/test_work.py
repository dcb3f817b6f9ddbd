"""Operations beside those that torch counts, and pairs beside the mask."""

from types import SimpleNamespace

import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from wsm_model.config import Variant
from wsm_model.model import Attention
from wsm_model.mot.mask import dense_mask
from wsm_model.training.work import StepWork, latent_flop, speed, work_of

GOAL_PRODUCTS = 2 * ((3 + 6 * 4) * 48 + 48 * 48)
"""Of a sequence: 27 Fourier features to a width of 48, and that to itself."""


@pytest.mark.parametrize("variant", Variant)
@pytest.mark.parametrize("goal_tokens", [1, 3])
def test_operations_of_a_pass_are_those_that_torch_counts(make_model, make_inputs, make_spans, variant, goal_tokens):
    """With more tokens than one the goal stands in for each of them: the model makes one, and it is repeated."""
    model = make_model(variant, Attention.DENSE, goal_tokens=goal_tokens)
    inputs = make_inputs(make_spans([5, 5], [1, 2]))
    one = model.goal_context
    model.goal_context = lambda *given: one(*given).expand(-1, -1, goal_tokens, -1)
    with FlopCounterMode(display=False) as counter, torch.no_grad():
        model(inputs)
    counts = counter.get_flop_counts()["Global"]
    products = sum(count for name, count in counts.items() if str(name) in ("aten.mm", "aten.addmm"))
    assert products == 10 * latent_flop(model) + 2 * GOAL_PRODUCTS


@pytest.mark.parametrize("variant", Variant)
def test_a_step_is_three_forward_passes_over_the_pairs_of_the_mask(make_model, make_inputs, make_spans, variant):
    model, spans = make_model(variant), make_spans([6, 4, 1], [1, 3, 2])
    table = make_inputs(spans).table
    padding = 2 * sum(model.config.tokens.values()) * (3 * 6 - 11)  # each sees itself, and is no pair of a sequence
    pairs = int(dense_mask(model.config, table).sum()) - padding
    work = work_of(model, spans)
    width, layers = model.config.attention_width, model.config.layers
    assert work.flop == 3 * (11 * latent_flop(model) + 4 * pairs * width * layers)
    assert (work.latents, work.tokens) == (11, 11 * 2 * sum(model.config.tokens.values()))


def test_speed_is_work_by_time():
    found = SimpleNamespace(**speed(StepWork(latents=10, tokens=2480, flop=4e12), 2.0))
    assert (found.latents_per_second, found.tokens_per_second, found.tflop_per_second) == (5.0, 1240.0, 2.0)
