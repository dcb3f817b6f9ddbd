"""The average of the weights beside its recursion, and what it is lent for."""

import torch

from wsm_model.training.average import averaged, follow, start_average


def test_it_is_the_recursion_with_the_young_decay_before_its_own(make_model):
    """Decay of steps 1 and 2: 2/11 and 3/12; of step 40: min(0.75, 41/50) = 0.75."""
    model = make_model()
    average = start_average(model, 0.75)
    assert average is not None
    wanted = {name: parameter.detach().clone() for name, parameter in model.named_parameters()}
    for step, decay in ((1, 2 / 11), (2, 3 / 12), (40, 0.75)):
        for name, parameter in model.named_parameters():
            torch.nn.init.normal_(parameter, generator=torch.Generator().manual_seed(step))
            wanted[name] = decay * wanted[name] + (1 - decay) * parameter.detach()
        follow(average, model, step)
    for name, tensor in average.weights.items():
        torch.testing.assert_close(tensor, wanted[name], rtol=1e-6, atol=1e-6)


def test_it_is_lent_to_the_model_and_both_come_back_to_the_bit(make_model):
    model = make_model()
    average = start_average(model, 0.9)
    assert average is not None
    for parameter in model.parameters():
        torch.nn.init.normal_(parameter)
    own = {name: parameter.detach().clone() for name, parameter in model.named_parameters()}
    kept = {name: tensor.clone() for name, tensor in average.weights.items()}
    with averaged(model, average):
        assert all(torch.equal(parameter, kept[name]) for name, parameter in model.named_parameters())
    assert all(torch.equal(parameter, own[name]) for name, parameter in model.named_parameters())
    assert all(torch.equal(tensor, kept[name]) for name, tensor in average.weights.items())


def test_a_decay_of_nothing_keeps_none(make_model):
    model = make_model()
    assert start_average(model, 0.0) is None
    with averaged(model, None):
        pass
