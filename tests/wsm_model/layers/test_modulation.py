"""The float32 islands."""

import torch

from wsm_model.layers.modulation import gated_sum, modulated_norm


def test_the_norm_has_mean_zero_and_variance_one_before_shift_and_scale():
    torch.manual_seed(0)
    x, shift, scale = torch.randn(4, 64) * 5 + 3, torch.randn(64), torch.randn(64)
    plain = modulated_norm(x, torch.zeros(64), torch.zeros(64), 1e-6)
    torch.testing.assert_close(plain.mean(-1), torch.zeros(4), rtol=0, atol=1e-6)
    torch.testing.assert_close(plain.var(-1, unbiased=False), torch.ones(4), rtol=1e-5, atol=0)
    torch.testing.assert_close(modulated_norm(x, shift, scale, 1e-6), plain * (1 + scale) + shift)


def test_sums_of_bfloat16_are_made_in_float32_and_rounded_once():
    x, change, gate = torch.tensor([256.0]).bfloat16(), torch.tensor([1.0]).bfloat16(), torch.tensor([3.0])
    with torch.autocast("cpu", torch.bfloat16):
        found = gated_sum(x, change, gate)
    assert found.dtype == torch.bfloat16
    assert float(found) == 260.0  # 259 rounded to the 8 bits of bfloat16; one after the other 256 + 1 would stay 256
