"""What a run is planned to take: the clips of its steps, the share of a rank, and how that is told."""

from dataclasses import replace

import pytest
import torch

from pipelines.training.config import TrainRunConfig
from pipelines.training.data import model_config, training_loader
from pipelines.training.plan import TrainingPlan, plan_text, require_fit, training_plan
from wsm_data.errors import ConfigError
from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_model.training.budget import HardwareConfig, model_cost, step_flop
from wsm_model.training.config import TrainingConfig

HARDWARE = HardwareConfig(gpus=8, memory_gib=4.0, reserve_gib=1.0, peak_tflops=100.0, efficiency=0.5)
PLAN = TrainingPlan(memory={"weights": 3 * 2.0**30, "reserve": 2.0**30}, latents=6, flop=2e12, seconds=864.0, steps=100)


@pytest.fixture
def config(tiny) -> TrainRunConfig:
    return TrainRunConfig(
        sources=(SourceConfig(release=str(tiny.folder)),),
        order=OrderConfig(global_batch=2, max_latents=4),
        read=ReadConfig(threads=0),
        training=TrainingConfig(max_steps=7),
        hardware=replace(HARDWARE, gpus=1),
    )


@pytest.fixture
def planned(config, tiny):
    """Plans a run of other settings over the five training clips, two steps an epoch."""
    shape = replace(model_config(config, tiny.manifest), layers=1)

    def plan(**changes) -> TrainingPlan:
        changed = replace(config, **changes)
        with training_loader(changed, torch.device("cpu"), "", 0, 1) as loader:
            return training_plan(changed, shape, loader)

    plan.shape = shape
    return plan


def test_a_step_takes_what_the_clips_of_an_epoch_take_over_its_steps(planned, config, tiny):
    plan = planned()
    cost = model_cost(planned.shape, config.training.precision)
    clips = [min(4, len(clip.rgb_latent)) for clip in tiny.clips[:5]]
    epoch = sum(step_flop(planned.shape, cost, {latents: 1.0}, is_recomputed=False) for latents in clips)
    assert plan.flop == pytest.approx(epoch / 2)
    assert plan.seconds == pytest.approx(plan.flop / 50e12)  # half of 100 TFLOP/s
    assert plan.steps == 7


def test_a_rank_passes_its_share_of_the_rows_or_as_many_as_the_settings_say(planned, config, tiny):
    longest = min(4, max(len(clip.rgb_latent) for clip in tiny.clips[:5]))
    assert planned().latents == 2 * longest
    assert planned(training=replace(config.training, micro_rows=1)).latents == longest
    assert planned(hardware=replace(config.hardware, gpus=2)).latents == longest


def test_the_text_says_the_sum_of_memory_days_and_gpu_hours(config):
    """100 steps of 864 s are a day: 24 hours of 8 GPUs."""
    lines = [" ".join(line.split()) for line in plan_text(PLAN, replace(config, hardware=HARDWARE)).splitlines()]
    assert lines == [
        "memory of one of 8 GPUs GiB",
        "weights 3.00",
        "reserve 1.00",
        "sum, of 4 4.00",
        "a step: 2.0 TFLOP, 864.00 s at 50% of 8 x 100 TFLOP/s",
        "in all: 1.00 days, 192 GPU hours",
    ]


def test_what_fills_the_memory_fits_and_more_is_refused_with_the_largest_part(config):
    require_fit(PLAN, replace(config, hardware=HARDWARE))
    smaller = replace(config, hardware=replace(HARDWARE, memory_gib=3.9))
    with pytest.raises(
        ConfigError, match=r"a GPU of 3\.9 GiB .* must hold the 4\.0 GiB .* most is 'weights'.* 6 latents"
    ):
        require_fit(PLAN, smaller)
