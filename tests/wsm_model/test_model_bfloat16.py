"""The bfloat16 path under autocast: what stays float32, and how near it is to float32."""

from collections.abc import Callable

import pytest
import torch
from torch import nn
from torch.nn import functional

from wsm_model.config import Expert, Variant
from wsm_model.losses.total import LossConfig, pretraining_loss
from wsm_model.model import Attention
from wsm_model.mot import block, expert

HALF_ULP = 2.0**-8
"""Largest relative error of rounding to the 8 bits of bfloat16."""
FLOAT32 = 1e-6
"""Of some operations in float32."""


@pytest.fixture
def inputs(make_inputs, make_spans):
    return make_inputs(make_spans([7, 5], [3, 2]))


def bfloat16() -> torch.autocast:
    return torch.autocast("cpu", torch.bfloat16)


def root_mean_square(values: torch.Tensor) -> float:
    return float(values.detach().float().square().mean().sqrt())


@pytest.mark.parametrize("variant", Variant)
@pytest.mark.parametrize("attention", [Attention.BLOCKS, Attention.DENSE])
def test_outputs_and_gradients_are_those_of_float32_to_the_rounding_of_bfloat16(make_model, inputs, variant, attention):
    """Two layers round each token some ten times, by 2^-8 at most: 3 % leaves room, a wrong formula is beyond it."""
    noise = torch.randn(inputs.rgb.shape, generator=torch.Generator().manual_seed(5))
    found = []
    for inside in (False, True):
        model = make_model(variant, attention)
        with torch.autocast("cpu", torch.bfloat16, enabled=inside):
            outputs = model(inputs)
        report = pretraining_loss(inputs, outputs, noise, LossConfig())
        report.total.backward()
        found.append((outputs, report, {name: one.grad for name, one in model.named_parameters()}))
    (exact, exact_report, exact_gradients), (near, near_report, near_gradients) = found
    real = inputs.table.sequence >= 0
    for name in ("velocity", "depth", "poses"):
        if getattr(exact, name) is not None:
            wanted, rounded = getattr(exact, name)[real], getattr(near, name)[real].float()
            assert root_mean_square(rounded - wanted) < 0.03 * root_mean_square(wanted), name
            assert not torch.equal(rounded, wanted), name  # bfloat16 was at work
    assert near_report.total.item() == pytest.approx(exact_report.total.item(), rel=0.01)
    all_exact, all_near = (torch.cat([one.flatten() for one in g.values()]) for g in (exact_gradients, near_gradients))
    assert functional.cosine_similarity(all_near, all_exact, dim=0) > 0.999
    assert {gradient.dtype for gradient in near_gradients.values()} == {torch.float32}


def test_losses_poses_and_what_modulates_are_float32(make_model, inputs):
    model = make_model()
    with bfloat16():
        outputs = model(inputs)
        streams = model.training_streams(inputs, inputs.table)
    assert outputs.poses.dtype == torch.float32
    assert outputs.velocity.dtype == torch.bfloat16
    report = pretraining_loss(inputs, outputs, torch.zeros_like(inputs.rgb), LossConfig())
    assert {report.total.dtype, *(part.dtype for part in report.parts.values())} == {torch.float32}
    for kind, one in streams.items():
        assert one.x.dtype == (torch.float32 if kind is Expert.POSE else torch.bfloat16)
        assert {one.time.dtype, one.modulation.dtype, one.rope[0].dtype, one.rope[1].dtype} == {torch.float32}


def test_every_norm_and_residual_sum_of_a_pass_is_exact_but_for_one_rounding(make_model, inputs, monkeypatch):
    """Each is compared, where it is called, with the same formula in float64 on the very numbers it was given."""
    calls = {"norm": 0, "sum": 0}

    def norm(x, shift, scale, eps, *, real: Callable[..., torch.Tensor] = block.modulated_norm):
        found = real(x, shift, scale, eps)
        wanted = functional.layer_norm(x.double(), (x.shape[-1],), eps=eps) * (1 + scale.double()) + shift.double()
        require_one_rounding(found, wanted)
        calls["norm"] += 1
        return found

    def residual(x, change, gate, *, real: Callable[..., torch.Tensor] = block.gated_sum):
        found = real(x, change, gate)
        require_one_rounding(found, x.double() + change.double() * gate.double())
        calls["sum"] += 1
        return found

    monkeypatch.setattr(block, "modulated_norm", norm)
    monkeypatch.setattr(expert, "modulated_norm", norm)
    monkeypatch.setattr(block, "gated_sum", residual)
    with torch.no_grad(), bfloat16():
        make_model()(inputs)
    layers_and_experts = 2 * 3
    assert calls == {"norm": 2 * layers_and_experts + 2, "sum": 2 * layers_and_experts}  # + heads of RGB and depth


def require_one_rounding(found: torch.Tensor, wanted: torch.Tensor) -> None:
    """Nearest value of its dtype, but for ties that float32 decides: 1e-4 of a step on top, and sums near zero."""
    step = HALF_ULP if found.dtype == torch.bfloat16 else FLOAT32  # pose tokens stay float32
    limit = step * 1.0001 * wanted.abs() + 1e-5
    assert ((found.double() - wanted).abs() <= limit).all()


def test_norms_of_queries_and_keys_are_computed_in_float32(make_model):
    model = make_model()
    attention = model.layers[0].experts[Expert.GENERATION.value].attention
    norm, attention.to_q = attention.norm_q, nn.Identity()
    assert isinstance(norm, nn.RMSNorm)
    nn.init.normal_(norm.weight)
    x = (torch.randn(500, norm.weight.shape[0], generator=torch.Generator().manual_seed(0)) * 3).bfloat16()
    with torch.no_grad(), bfloat16():
        found = attention.queries(x).flatten(-2)
    exact = x.double()
    wanted = exact * (exact.square().mean(-1, keepdim=True) + norm.eps).rsqrt() * norm.weight.double()
    assert ((found.double() - wanted).abs() <= HALF_ULP * 1.0001 * wanted.abs() + 1e-7).all()


def test_the_affine_norm_before_the_goal_is_computed_in_float32(make_model):
    cross = make_model(goal_tokens=2).layers[0].experts[Expert.GENERATION.value].cross_attention
    nn.init.normal_(cross.norm.weight)
    nn.init.normal_(cross.norm.bias)
    seen: list[torch.Tensor] = []
    cross.to_q.register_forward_pre_hook(lambda _, given: seen.append(given[0]))
    generator = torch.Generator().manual_seed(0)
    x, context = (torch.randn(1, 4, size, 48, generator=generator).bfloat16() for size in (6, 2))
    with torch.no_grad(), bfloat16():
        cross(x, context)
    wanted = functional.layer_norm(
        x.double(), (48,), cross.norm.weight.double(), cross.norm.bias.double(), cross.norm.eps
    )
    require_one_rounding(seen[0], wanted)
