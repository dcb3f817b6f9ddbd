import torch

from wsm_model.posttraining.dream_attention import with_dream_attention


def test_matrices_for_dreams_are_equal_at_first_and_so_is_what_is_computed(make_model, make_inputs, make_spans):
    model, inputs = make_model(), make_inputs(make_spans([5, 4], [2, 3]))
    doubled = with_dream_attention(model)
    assert not model.config.own_dream_attention
    assert torch.equal(doubled(inputs).velocity, model(inputs).velocity)
    assert with_dream_attention(doubled) is doubled


def test_what_was_seen_does_not_pass_through_the_matrices_of_dreams(make_model, make_inputs, make_spans):
    doubled, inputs = with_dream_attention(make_model()), make_inputs(make_spans([5], [2]))
    before = doubled(inputs)
    with torch.no_grad():
        for name, parameter in doubled.named_parameters():
            if "dream_attention" in name:
                parameter.add_(0.1)
    after = doubled(inputs)
    assert torch.equal(after.depth, before.depth)
    assert torch.equal(after.poses, before.poses)
    assert not torch.allclose(after.velocity, before.velocity)
