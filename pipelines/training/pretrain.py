"""A training run in its folder: started, or gone on with, and evaluated at its end.

RUN/run.json            settings, resolved
RUN/metrics.jsonl       a line per logged step
RUN/tensorboard/        the same for TensorBoard
RUN/checkpoints/        step-000500/ ..., and model.json, which says what their weights are
RUN/ledger/             which step saw which clip
RUN/profile/            a trace of some steps, where it is asked for
RUN/samples/            dreams and estimates beside the truth
RUN/curves.png
RUN/model/              model.safetensors and model.json, at the end
RUN/evaluations/        errors on held-out clips on the way, where they are asked for
RUN/evaluation.json     errors on held-out clips, at the end
"""

import dataclasses
import json
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import torch

from pipelines.running.disk.full_disk import full_disk_named
from pipelines.running.folder import locked
from pipelines.running.interrupts import termination_noted
from pipelines.training.config import TrainRunConfig
from pipelines.training.data import training_loader
from pipelines.training.hooks import evaluate_whole, require_decodable, run_hooks
from pipelines.training.pictures import draw_curves
from pipelines.training.start import StartedRun, start_run, with_standard
from wsm_data.files.atomic import write_text
from wsm_data.loaders.loader import ClipLoader
from wsm_model.model_file import save_card, save_model
from wsm_model.mot.compiled import compile_blocks
from wsm_model.ranks import leave_ranks, rank_and_world_size, start_ranks, wait_for_all, whole_model
from wsm_model.training.average import averaged
from wsm_model.training.initial import CHECKPOINTS, MODEL
from wsm_model.training.loop import resume, train
from wsm_model.training.pretraining import pretraining_step


def run_training(config: TrainRunConfig, out: Path, *, quiet: bool) -> str | None:
    """Train in a folder, from its latest checkpoint where it has one.

    Args:
        config: settings.
        out: the run's folder.
        quiet: no progress bar.

    Returns:
        The table of errors on held-out clips, empty where there are none, on the first rank; None elsewhere.

    Raises:
        ConfigError: the settings do not fit the releases, the folder belongs to another run, or another process trains
            in it.
        IntegrityError: a release or a checkpoint is damaged.
        NumericalError: a loss is not finite.
        Preempted: SIGTERM came; a checkpoint holds the step that was being worked on.
    """
    device = start_ranks()
    rank, _ = rank_and_world_size()
    try:
        with full_disk_named(out), nullcontext() if rank else locked(out):
            return _run(with_standard(config, out), out, device, quiet)
    finally:
        leave_ranks()


def _run(config: TrainRunConfig, out: Path, device: torch.device, quiet: bool) -> str | None:
    require_decodable(config)
    rank, world_size = rank_and_world_size()
    with training_loader(config, device, str(out / "ledger"), rank, world_size) as loader:
        started = start_run(config, out, loader, device)
        _train(config, out, started, loader, device, quiet)
    with averaged(started.model, started.run.average):
        save_model(out / MODEL, started.model, started.card)
        if rank == 0:
            draw_curves(out)
        with whole_model(started.model) as model:
            table = evaluate_whole(config, out / "evaluation.json", model, device, quiet)
    return None if rank else table


def _train(
    config: TrainRunConfig, out: Path, started: StartedRun, loader: ClipLoader, device: torch.device, quiet: bool
) -> None:
    rank, _ = rank_and_world_size()
    run, model = started.run, started.model
    done = resume(run, loader)
    with (
        termination_noted() as must_stop,
        run_hooks(config, out, started, done=done, device=device, quiet=quiet, must_stop=must_stop) as hooks,
    ):
        if rank == 0:  # only now is it certain that the folder is this run's, and that nothing is refused any more
            write_text(out / "run.json", json.dumps(dataclasses.asdict(config), indent=1, sort_keys=True) + "\n")
            save_card(out / CHECKPOINTS, started.card)
        wait_for_all()
        model.checkpoint_activations = config.training.checkpoint_activations
        if config.training.compile:
            compile_blocks(model)
        model.train()
        step = partial(pretraining_step, model, run, config.training)
        train(run, step, loader, config.training, hooks=hooks, done=done)
