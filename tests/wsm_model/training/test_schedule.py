"""Learning rate and groups."""

import pytest

from wsm_model.config import Expert
from wsm_model.mot.transformer import expert_of_parameter
from wsm_model.training.config import OptimiserConfig
from wsm_model.training.schedule import learning_rate, make_optimiser, set_learning_rate

PAPER = OptimiserConfig()


def test_it_rises_over_five_per_cent_and_falls_to_a_tenth():
    """Table of the paper: peak 3e-5, final 3e-6, 5 % linear warm-up, cosine decay."""
    rates = [learning_rate(step, 1000, PAPER) for step in range(1000)]
    assert rates[0] == pytest.approx(3e-5 / 50)
    assert rates[49] == pytest.approx(3e-5)
    assert rates[50] == pytest.approx(3e-5)
    assert rates[-1] == pytest.approx(3e-6)
    assert max(rates) == pytest.approx(3e-5)
    middle = 50 + (999 - 50) / 2
    assert learning_rate(int(middle), 1000, PAPER) == pytest.approx((3e-5 + 3e-6) / 2, rel=0.01)
    assert rates[50:] == sorted(rates[50:], reverse=True)


def test_a_run_of_one_step_has_a_rate():
    assert learning_rate(0, 1, PAPER) > 0


def test_generation_expert_and_goal_embedding_take_three_tenths(make_model):
    model = make_model()
    optimiser = make_optimiser(model, PAPER)
    set_learning_rate(optimiser, 1e-3)
    slower, others = optimiser.param_groups
    assert (slower["lr"], others["lr"]) == (pytest.approx(3e-4), 1e-3)
    wanted = [one for name, one in model.named_parameters() if expert_of_parameter(name) in (Expert.GENERATION, None)]
    assert {id(one) for one in slower["params"]} == {id(one) for one in wanted}
    assert len(slower["params"]) + len(others["params"]) == len(list(model.parameters()))
    assert (slower["betas"], slower["weight_decay"], slower["eps"]) == ((0.9, 0.95), 0.01, 1e-8)


@pytest.mark.parametrize("changes", [{"final_learning_rate": 1.0}, {"warmup_share": 1.0}, {"final_learning_rate": 0.0}])
def test_settings_that_make_no_schedule_are_refused(changes):
    with pytest.raises(ValueError, match="must lie in"):
        OptimiserConfig(**changes)


@pytest.mark.parametrize(
    "changes",
    [{"beta_1": 1.0}, {"beta_2": -0.1}, {"eps": -1.0}, {"weight_decay": float("nan")}, {"clip_norm": 0.0}],
)
def test_settings_that_make_no_optimiser_are_refused_by_name(changes):
    with pytest.raises(ValueError, match=f"^{next(iter(changes))} must"):
        OptimiserConfig(**changes)


def test_norms_biases_and_tables_decay_unless_they_are_exempt(make_model):
    model = make_model()
    names = {parameter: name for name, parameter in model.named_parameters()}
    for decays, wanted in ((True, set()), (False, {"weight", "bias", "table"})):
        optimiser = make_optimiser(model, OptimiserConfig(decay_vectors=decays))
        exempt = [
            (names[one], one.dim())
            for group in optimiser.param_groups
            if not group["weight_decay"]
            for one in group["params"]
        ]
        assert {name.rsplit(".", 1)[1] for name, _ in exempt} == wanted
        assert all(dimensions == 1 or name.endswith("table") for name, dimensions in exempt)
    assert len(exempt) == sum(one.dim() == 1 or name.endswith("table") for one, name in names.items())
