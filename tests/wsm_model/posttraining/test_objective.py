import numpy as np
import pytest
import torch

from wsm_model.posttraining.objective import ObjectiveConfig, Velocities, nft_loss

SHAPE = (3, 2, 4, 2, 3)


def random(seed):
    return torch.randn(SHAPE, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def reference_loss(trained, old, pretrained, dream, noisy, tau, rho, config):
    """The public code's formulas, dream by dream, in float64 (spec/closed_loop.md C 3 to 5)."""
    total = 0.0
    for g in range(len(dream)):
        v, v_old, x0, x_t = (one[g].ravel() for one in (trained, old, dream, noisy))
        parts = []
        for velocity in (
            config.beta * v + (1 - config.beta) * v_old,
            (1 + config.beta) * v_old - config.beta * v,
        ):
            x = x_t - tau[g] * velocity
            parts.append(np.mean((x - x0) ** 2) / max(np.mean(np.abs(x - x0)), 1e-5))
        total += (rho[g] * parts[0] + (1 - rho[g]) * parts[1]) / config.beta / len(dream)
    return config.advantage_max * total + config.reference * np.mean((trained - pretrained) ** 2)


@pytest.mark.parametrize(
    "config",
    [
        ObjectiveConfig(),
        ObjectiveConfig(beta=1.0, advantage_max=2.0, reference=0.5),
        ObjectiveConfig(beta=0.3, reference=0.0),
    ],
)
def test_the_loss_is_that_of_the_public_code(config):
    """Against float64, relative 1e-5: the branches are float32."""
    trained, old, pretrained, dream, noise = (random(seed) for seed in range(5))
    tau, rho = torch.tensor([1.0, 0.75, 0.417]).double(), torch.tensor([0.9, 0.5, 0.0]).double()
    noisy = (1 - tau.view(-1, 1, 1, 1, 1)) * dream + tau.view(-1, 1, 1, 1, 1) * noise
    given = [one.float() for one in (dream, noisy, tau, rho)]
    found = nft_loss(Velocities(trained=trained.float(), old=old.float(), reference=pretrained.float()), *given, config)
    arrays = [one.numpy() for one in (trained, old, pretrained, dream, noisy, tau, rho)]
    assert float(found.loss) == pytest.approx(reference_loss(*arrays, config), rel=1e-5)


def test_no_gradient_flows_through_the_normaliser_and_the_old_policy():
    """d loss / dv of one dream by hand: tau beta times 2 (x - x0) / (n q), weighted."""
    old, dream, noisy = (random(seed).float()[:1] for seed in (1, 2, 3))
    trained = random(0).float()[:1].requires_grad_()
    config, tau = ObjectiveConfig(beta=1.0, reference=0.0, advantage_max=1.0), torch.tensor([0.5])
    nft_loss(
        Velocities(trained=trained, old=old, reference=old), dream, noisy, tau, torch.tensor([1.0]), config
    ).loss.backward()
    off = noisy - 0.5 * trained.detach() - dream
    np.testing.assert_allclose(trained.grad, -0.5 * 2 * off / off.numel() / off.abs().mean(), rtol=1e-4, atol=1e-7)


def test_a_step_against_the_gradient_nears_a_good_dream_and_leaves_a_bad_one():
    for rho, is_nearer in ((1.0, True), (0.0, False)):
        old, dream, noisy = (random(seed).float()[:1] for seed in (1, 2, 3))
        trained = old.clone().requires_grad_()
        velocities = Velocities(trained=trained, old=old, reference=old)
        nft_loss(velocities, dream, noisy, torch.tensor([0.5]), torch.tensor([rho]), ObjectiveConfig()).loss.backward()
        wanted = (noisy - dream) / 0.5
        before, after = ((one - wanted).square().mean() for one in (old, old - 0.1 * trained.grad))
        assert bool(after < before) is is_nearer
