"""Cross-attention to the one goal token, beside the attention that Wan2.2 has there."""

import pytest
import torch

from wsm_model.config import Expert
from wsm_model.mot.block import CrossAttention, OneTokenAttention


@pytest.mark.parametrize("expert", [Expert.GENERATION, Expert.POSE])
def test_attention_to_one_token_is_its_value_whatever_is_asked(config, expert):
    """The softmax over one key is exactly 1, so nothing but the order of sums in the products can differ."""
    torch.manual_seed(0)
    width = config.expert(expert).width
    full, one = CrossAttention(width, config), OneTokenAttention(width, config)
    one.load_state_dict({name: value for name, value in full.state_dict().items() if name in one.state_dict()})
    x, context = 10 * torch.randn(2, 3, 6, width), torch.randn(2, 3, 1, config.generation.width)
    wanted = full(x, context)
    torch.testing.assert_close(one(x, context).expand_as(wanted), wanted, rtol=1e-5, atol=1e-6)


def test_queries_keys_and_norms_before_one_key_never_get_a_gradient(config):
    full = CrossAttention(config.generation.width, config)
    full(torch.randn(1, 2, 6, 48), torch.randn(1, 2, 1, 48)).square().sum().backward()
    moved = {name for name, one in full.named_parameters() if one.grad is not None and one.grad.abs().max() > 1e-6}
    assert moved == {"to_v.weight", "to_v.bias", "to_out.weight", "to_out.bias"}


def test_a_model_has_queries_and_keys_across_only_where_there_are_several_tokens(make_model):
    def across(model):
        return {name for name, _ in model.named_parameters() if "cross_attention" in name}

    one, several = across(make_model()), across(make_model(goal_tokens=2))
    assert {name.split("cross_attention.")[1] for name in several - one} == {
        f"{part}.{kind}" for part in ("to_q", "to_k", "norm") for kind in ("weight", "bias")
    } | {"norm_q.weight", "norm_k.weight"}
