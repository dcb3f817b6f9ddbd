"""The loop with a step that is not pretraining's."""

import time
from dataclasses import replace

import pytest
import torch

from wsm_data.errors import NumericalError, Preempted
from wsm_model.training.checkpoint import checkpoints
from wsm_model.training.config import LoopConfig, OptimiserConfig
from wsm_model.training.loop import Hooks, StepResult, TrainingRun, finish_step, resume, train

CONFIG = LoopConfig(
    max_steps=5,
    checkpoint_every=2,
    sample_every=2,
    evaluate_every=3,
    log_every=2,
    optimiser=OptimiserConfig(learning_rate=1e-2, final_learning_rate=1e-2),
)


class Numbers:
    """An endless epoch of the numbers of its steps."""

    def __init__(self):
        self.steps, self.step = 1000, 0

    def __iter__(self):
        while self.step < self.steps:
            self.step += 1
            yield self.step

    def state_dict(self):
        return {"step": self.step}

    def load_state_dict(self, state):
        self.step = state["step"]


def run_of(folder) -> TrainingRun:
    torch.manual_seed(0)
    model = torch.nn.Linear(3, 1)
    groups = [{"params": list(model.parameters()), "learning_rate_factor": 1.0}]
    return TrainingRun(model=model, optimiser=torch.optim.AdamW(groups), folder=folder, identity={"of": "numbers"})


def trained(run: TrainingRun, bad_step: int = 0, told_to_end_at: int = 0):
    """Weights at the end, and what was seen and told on the way."""
    told = {"batches": [], "metrics": [], "sample": [], "evaluate": [], "progress": []}

    def step(number: int) -> StepResult:
        told["batches"].append(number)
        run.optimiser.zero_grad()
        loss = run.model(torch.full((1, 3), float("nan") if number == bad_step else float(number))).square().sum()
        loss.backward()
        return finish_step(run, {"loss": float(loss.detach())}, 1.0, lambda wrong: f"number {number}: {wrong}")

    hooks = Hooks(
        metrics=lambda step, values: told["metrics"].append((step, values["learning_rate"])),
        sample=told["sample"].append,
        evaluate=told["evaluate"].append,
        progress=told["progress"].append,
        must_stop=lambda: told["batches"][-1] == told_to_end_at,
    )
    loader = Numbers()
    train(run, step, loader, CONFIG, hooks=hooks, done=resume(run, loader))
    return run.model.weight.detach().clone(), told


def test_any_step_is_taken_told_and_kept(tmp_path):
    _, told = trained(run_of(tmp_path))
    assert told["batches"] == told["progress"] == [1, 2, 3, 4, 5]
    assert told["metrics"] == [(2, 1e-2), (4, 1e-2), (5, 1e-2)]
    assert told["sample"] == [2, 4]
    assert told["evaluate"] == [3]
    assert [path.name for path in checkpoints(tmp_path)] == ["step-000004", "step-000005"]


def test_a_run_that_ends_in_an_error_goes_on_from_its_last_checkpoint_to_the_same_bits(tmp_path):
    wanted, _ = trained(run_of(tmp_path / "a"))
    with pytest.raises(NumericalError, match="number 4: loss"):
        trained(run_of(tmp_path / "b"), bad_step=4)
    found, told = trained(run_of(tmp_path / "b"))
    assert told["batches"] == [3, 4, 5]
    assert torch.equal(found, wanted)


def test_told_to_end_it_saves_the_step_it_is_at_and_goes_on_to_the_same_bits(tmp_path):
    wanted, _ = trained(run_of(tmp_path / "a"))
    with pytest.raises(Preempted, match=r"step-000003 holds step 3; run the same command again") as told:
        trained(run_of(tmp_path / "b"), told_to_end_at=3)
    assert told.value.exit_code == 128 + 15  # of a program that SIGTERM ended
    found, told = trained(run_of(tmp_path / "b"))
    assert told["batches"] == [4, 5]
    assert torch.equal(found, wanted)


def test_told_to_end_at_the_last_step_it_has_ended(tmp_path):
    trained(run_of(tmp_path), told_to_end_at=5)
    assert [path.name for path in checkpoints(tmp_path)] == ["step-000004", "step-000005"]


def test_a_step_says_how_long_its_data_was_waited_for(tmp_path):
    """The third batch comes 0.05 s late, and time that a step takes is not waited for."""

    class Late(Numbers):
        def __iter__(self):
            for number in super().__iter__():
                time.sleep(0.05 if number == 3 else 0.0)
                yield number

    def step(_: int) -> StepResult:
        time.sleep(0.01)
        return StepResult(losses={"loss": 0.0}, gradient_norm=0.0)

    waited: dict[int, float] = {}
    hooks = Hooks(
        metrics=lambda number, values: waited.update({number: values["data_wait_seconds"]}),
        sample=lambda _: None,
        progress=lambda _: None,
        must_stop=lambda: False,
    )
    train(run_of(tmp_path), step, Late(), replace(CONFIG, log_every=1, sample_every=0), hooks=hooks, done=0)
    assert max(waited, key=waited.__getitem__) == 3
    assert waited[3] >= 0.05
