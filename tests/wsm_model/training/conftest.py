"""A loader of random batches, and a run over it in this process."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.precision import Precision
from wsm_model.training.config import OptimiserConfig, TrainingConfig
from wsm_model.training.loop import Hooks, TrainingRun, resume, train
from wsm_model.training.pretraining import pretraining_step
from wsm_model.training.schedule import make_optimiser

ROWS, FRAMES = 4, 6


class RandomLoader:
    """Steps of an endless epoch; each is a pure function of its number."""

    def __init__(self, make_poses: Callable[..., torch.Tensor], spoil: dict[int, str] | None = None):
        self.steps = 1000
        self.step = 0
        self._make_poses, self._spoil = make_poses, spoil or {}

    def __iter__(self) -> Iterator[SimpleNamespace]:
        while self.step < self.steps:
            batch = self._batch(self.step)
            self.step += 1
            yield batch

    def state_dict(self) -> dict[str, int]:
        return {"step": self.step}

    def load_state_dict(self, state: dict[str, int]) -> None:
        self.step = state["step"]

    def _batch(self, step: int) -> SimpleNamespace:
        generator = torch.Generator().manual_seed(step)
        latents = (ROWS, FRAMES, 6, 4, 6)
        batch = SimpleNamespace(
            rgb=torch.randn(latents, generator=generator),
            depth=torch.randn(latents, generator=generator),
            poses=self._make_poses(ROWS, FRAMES, 4, generator=generator),
            spans=tuple(
                SequenceSpan(row=row, start=0, length=length, chunk_size=1 + row)
                for row, length in enumerate((6, 5, 6, 3))
            ),
            goal_camera0_m=torch.randn(ROWS, 3, generator=generator),
            refs=np.arange(ROWS) + ROWS * step,
            keys=tuple(f"clip {step}/{row}" for row in range(ROWS)),
            epoch=0,
            step=step,
        )
        if step in self._spoil:
            getattr(batch, self._spoil[step])[1, 2] = float("nan")
        return batch


class Stop(Exception):
    """Ends a run in the middle, as a kill would."""


@pytest.fixture(scope="session")
def make_loader(make_poses) -> Callable[..., RandomLoader]:
    """Builds a loader; `spoil` puts a NaN into a tensor of a step."""
    return lambda spoil=None: RandomLoader(make_poses, spoil)


@pytest.fixture(scope="session")
def settings() -> TrainingConfig:
    """Six steps in float32 with a checkpoint after every second."""
    return TrainingConfig(
        max_steps=6,
        precision=Precision.FLOAT32,
        checkpoint_every=2,
        optimiser=OptimiserConfig(learning_rate=1e-3, final_learning_rate=1e-4),
    )


@pytest.fixture(scope="session")
def run(make_model, make_loader):
    """Trains a new model in a folder, from its checkpoints if it has any; returns model and metrics."""

    def train_in(folder: Path, config: TrainingConfig, *, kill_after: int = 0, spoil=None, identity=None):
        model, loader = make_model(), make_loader(spoil)
        own = TrainingRun(
            model=model,
            optimiser=make_optimiser(model, config.optimiser),
            folder=folder,
            identity=identity or {"model": "small"},
        )
        done = resume(own, loader)
        lines: list[dict[str, float]] = []

        def metrics(step: int, values: dict[str, float]) -> None:
            lines.append({"step": step, **values})
            if step == kill_after:
                raise Stop

        hooks = Hooks(metrics=metrics, sample=lambda _step: None, progress=lambda _done: None, must_stop=lambda: False)
        with suppress(Stop):
            train(own, partial(pretraining_step, model, own, config), loader, config, hooks=hooks, done=done)
        return model, lines

    return train_in


@pytest.fixture(scope="session")
def undisturbed(run, settings, tmp_path_factory) -> SimpleNamespace:
    """A run to its end: its folder, which nobody changes, the model and the metrics."""
    folder = tmp_path_factory.mktemp("undisturbed")
    model, lines = run(folder, settings)
    return SimpleNamespace(folder=folder, model=model, lines=lines)
