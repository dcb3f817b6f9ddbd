"""Settings of a training run that contradict one another."""

import pytest

from pipelines.training.config import TrainRunConfig
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config

HOMES = {"release": "homes"}


def built(*sources: dict[str, object], **settings: object) -> TrainRunConfig:
    return build_config(TrainRunConfig, {"sources": list(sources or [HOMES]), **settings})


def test_the_defaults_are_those_of_the_paper():
    """Table "Pretraining hyperparameters": batch 48, 10 epochs, 3e-5 to 3e-6, bfloat16; 8 sampler steps, K = 4."""
    config = built()
    assert (config.order.global_batch, config.training.epochs, config.training.precision) == (48, 10, "bfloat16")
    assert (config.training.optimiser.learning_rate, config.training.optimiser.final_learning_rate) == (3e-5, 3e-6)
    assert (config.held_out.flow_steps, config.held_out.session.chunk_size) == (8, 4)


def test_latents_that_are_not_standardised_are_refused():
    with pytest.raises(ConfigError, match=r"read\.standardise must be true"):
        built(read={"standardise": False})


@pytest.mark.parametrize(
    "sources",
    [
        ({"release": "homes", "split": "test"},),
        ({"release": "homes", "split": ""},),
        (HOMES, {"release": "homes", "split": "test", "weight": 0.1}),
    ],
)
def test_clips_that_are_trained_on_are_not_taken_for_held_out(sources):
    with pytest.raises(ConfigError, match=r"held_out\.split must name clips that are not trained on.*'test' of homes"):
        built(*sources)


@pytest.mark.parametrize(
    "sources",
    [
        (HOMES, {"release": "offices", "split": "test"}),
        ({"release": "homes", "split": "", "selection": "bright"},),
    ],
)
def test_another_release_and_a_selection_may_be_of_any_split(sources):
    assert len(built(*sources).sources) == len(sources)


@pytest.mark.parametrize("changes", [{"clips": -1}, {"flow_steps": 0}, {"max_latents": -1}, {"max_latents": 1}])
def test_what_cannot_be_measured_is_refused_before_the_run(changes):
    with pytest.raises(ConfigError, match=f"^held_out: .*{next(iter(changes))} "):
        built(held_out=changes)


def test_a_setting_that_makes_no_loss_is_named_with_its_section():
    with pytest.raises(ConfigError, match=r"^training\.loss: flow_shift must be above 0, found 0\.0"):
        built(training={"loss": {"flow_shift": 0.0}})
