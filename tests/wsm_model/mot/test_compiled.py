"""Compiled blocks beside plain ones; traced without a compiler, which a test machine need not have."""

import torch

from wsm_model.mot.compiled import compile_blocks


def test_outputs_and_gradients_are_those_of_plain_layers(make_model, make_inputs, make_spans):
    plain, compiled = make_model(layers=1), make_model(layers=1)
    compile_blocks(compiled, backend="eager")
    inputs = make_inputs(make_spans([3, 2], [1, 2]))
    outputs = [model(inputs) for model in (plain, compiled)]
    for one in outputs:
        (one.velocity.square().sum() + one.depth.square().sum() + one.poses.square().sum()).backward()
    torch.testing.assert_close(outputs[1].velocity, outputs[0].velocity, rtol=1e-5, atol=1e-5)
    torch.testing.assert_close(outputs[1].poses, outputs[0].poses, rtol=1e-5, atol=1e-5)
    for (name, wanted), (other, found) in zip(plain.named_parameters(), compiled.named_parameters(), strict=True):
        assert name == other
        torch.testing.assert_close(found.grad, wanted.grad, rtol=1e-4, atol=1e-4)
