import pytest

from wsm_model.posttraining.config import PosttrainingConfig
from wsm_model.posttraining.objective import ObjectiveConfig


def test_the_defaults_are_those_of_the_paper():
    """Its table "Post-training hyperparameters"."""
    config = PosttrainingConfig()
    assert (config.group, config.session.chunk_size, config.flow_steps, config.flow_shift) == (16, 4, 8, 5.0)
    assert (config.adapters.rank, config.adapters.alpha, config.objective.flow_times) == (32, 64, 4)
    assert (config.objective.beta, config.objective.advantage_max, config.objective.reference) == (0.1, 5.0, 1e-4)
    assert config.reward.temperature_m2 == 0.01
    optimiser = config.optimiser
    assert (optimiser.learning_rate, optimiser.final_learning_rate, optimiser.warmup_share) == (3e-5, 3e-6, 0.03)
    assert (optimiser.beta_1, optimiser.beta_2, optimiser.weight_decay, optimiser.clip_norm) == (0.9, 0.999, 1e-4, 1.0)
    assert config.epochs == 1


def test_a_group_of_one_and_more_flow_times_than_steps_are_refused():
    with pytest.raises(ValueError, match="at least 2 dreams"):
        PosttrainingConfig(group=1)
    with pytest.raises(ValueError, match="drawn without repeats"):
        PosttrainingConfig(flow_steps=2, objective=ObjectiveConfig(flow_times=3))
