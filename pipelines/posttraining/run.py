"""A run of post-training in its folder: started, or gone on with, measured at its end.

RUN/run.json            settings, resolved
RUN/metrics.jsonl       a line a step; RUN/tensorboard/ has the same
RUN/checkpoints/        adapters and moments: step-000050/ ...
RUN/ledger/             which step saw which query
RUN/samples/            groups on their maps, and films of the best and the worst dream
RUN/rollouts.parquet    a row a query, as `wsm score` reads it
RUN/evaluation.json     pretrained and post-trained policy on queries of other scenes
RUN/adapter/            the trained adapter in peft's layout
RUN/model/              with --merge: the model with the adapter in its matrices
"""

import dataclasses
import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import torch

from pipelines.posttraining.config import PosttrainRunConfig
from pipelines.posttraining.hooks import Progress, count_groups, posttraining_hooks
from pipelines.posttraining.measuring import measure_both, measured_queries
from pipelines.posttraining.pictures import draw_curves
from pipelines.posttraining.queries import queries_of
from pipelines.posttraining.rollouts import (
    ROLLOUT_LINES,
    ROLLOUTS_TABLE,
    flow_matching_loss,
    read_rows,
    real_future,
    rollout_row,
    write_rollouts,
)
from pipelines.running.disk.full_disk import full_disk_named
from pipelines.running.folder import locked
from pipelines.running.interrupts import termination_noted
from wsm_data.access.release import Release, open_release
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.jsonlines import line_appender
from wsm_data.loaders.batches.query_batch import QueryBatch
from wsm_data.loaders.config import LoaderConfig
from wsm_data.loaders.queries import QueryLoader
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.model_file import ModelCard, load_card, load_model, save_model
from wsm_model.posttraining.adapters import AdaptedModel
from wsm_model.posttraining.config import PosttrainingConfig
from wsm_model.posttraining.rollout import Query
from wsm_model.posttraining.step import posttraining_step, roll_out_all
from wsm_model.ranks import leave_ranks, rank_and_world_size, start_ranks, wait_for_all
from wsm_model.training.config import LoopConfig
from wsm_model.training.loop import StepResult, TrainingRun, resume, train
from wsm_model.training.schedule import make_optimiser

ADAPTER, MODEL = "adapter", "model"
_NOT_PART_OF_A_RUN = {one.name for one in dataclasses.fields(LoopConfig)} - {"optimiser"}
"""Settings that may change between two parts of a run: none of them changes what a step learns."""


def run_posttraining(config: PosttrainRunConfig, out: Path, *, merge: bool, quiet: bool) -> dict[str, object] | None:
    """Post-train in a folder, from its latest checkpoint where it has one.

    Args:
        config: settings.
        out: the run's folder.
        merge: write the merged model too.
        quiet: no progress bars.

    Returns:
        What was measured, on the first rank; None elsewhere.

    Raises:
        ConfigError: the settings do not fit the model, the release or the selection, or the folder is another run's.
        IntegrityError: a file is damaged.
        NumericalError: a loss is not finite.
        Preempted: SIGTERM came; a checkpoint holds the step that was being worked on.
    """
    device = start_ranks()
    rank, _ = rank_and_world_size()
    try:
        with full_disk_named(out), nullcontext() if rank else locked(out):
            return _run(config, out, device, merge, quiet)
    finally:
        leave_ranks()


def require_fit(config: PosttrainRunConfig, release: Release) -> ModelCard:
    """The card of the model, if it can be post-trained on the release.

    Raises:
        ConfigError: there is no such model, it has no SLAM, or its codec is another one.
    """
    card = load_card(Path(config.model))
    if card.config.variant is not Variant.SLAM:
        raise ConfigError(
            f"{config.model} must be a model with SLAM: without it nothing says where a dream leads; train one with "
            "model.variant=slam"
        )
    standard = latent_standard(release.manifest)
    if card.standard.codec_digest != standard.codec_digest:
        raise ConfigError(
            f"the model was trained on latents of {card.standard.codec} (digest {card.standard.codec_digest}), and the "
            f"release {release.manifest.name} has those of {standard.codec} (digest {standard.codec_digest}); use a "
            "release of the same codec"
        )
    return card


def _run(
    config: PosttrainRunConfig, out: Path, device: torch.device, merge: bool, quiet: bool
) -> dict[str, object] | None:
    rank, world_size = rank_and_world_size()
    release = open_release(config.source.release)
    card = require_fit(config, release)
    read = replace(config.read, device=str(device), standard=card.standard, pin_memory=device.type == "cuda")
    config = replace(config, read=read)
    settings = LoaderConfig(sources=(config.source,), order=config.order, read=read, ledger=str(out / "ledger"))
    queries = measured_queries(config, device) if rank == 0 else []  # refused before the first step
    model, _ = load_model(Path(config.model))
    torch.manual_seed(config.posttraining.seed)
    adapted = AdaptedModel(model.to(device), config.posttraining.adapters)
    with QueryLoader(settings, config.queries, rank=rank, world_size=world_size) as loader:
        run = TrainingRun(
            model=adapted.kept,
            optimiser=make_optimiser(_trained_alone(adapted), config.posttraining.optimiser),
            folder=out / "checkpoints",
            identity=_identity(config, card, loader),
        )
        _train(config, out, adapted, run, loader, release, quiet)
    if rank:
        return None
    return _finish(config, out, adapted, card, release, queries, merge, quiet)


def _trained_alone(adapted: AdaptedModel) -> torch.nn.Module:
    holder = torch.nn.Module()
    for number, parameter in enumerate(adapted.trained()):
        holder.register_parameter(f"layers_{number}", parameter)
    return holder


def _train(
    config: PosttrainRunConfig,
    out: Path,
    adapted: AdaptedModel,
    run: TrainingRun,
    loader: QueryLoader,
    release: Release,
    quiet: bool,
) -> None:
    rank, _ = rank_and_world_size()
    settings = config.posttraining
    standard = config.read.standard or latent_standard(release.manifest)
    progress = Progress(done=resume(run, loader))
    if rank == 0:
        write_text(out / "run.json", json.dumps(dataclasses.asdict(config), indent=1, sort_keys=True) + "\n")
    wait_for_all()
    (out / "rollouts").mkdir(parents=True, exist_ok=True)
    with (
        termination_noted() as must_stop,
        line_appender(out / "rollouts" / f"{rank:03d}-{ROLLOUT_LINES}") as append,
        posttraining_hooks(config, out, loader, progress, release, must_stop, quiet) as hooks,
    ):

        def step(batch: QueryBatch) -> StepResult:
            rolled = roll_out_all(adapted, queries_of(batch), settings, batch.history.epoch)
            result = posttraining_step(adapted, run, settings, rolled, batch.history.epoch)
            progress.done += 1
            _follow(adapted, settings, progress.done, loader.steps)
            for one in rolled:
                future = real_future(release, one.query, standard, settings.session.chunk_size)
                loss = flow_matching_loss(adapted, one, future, settings, batch.history.epoch)
                append({"step": progress.done, **rollout_row(one, f"epoch-{batch.history.epoch}", loss)})
            count_groups(progress, rolled)
            return result

        train(run, step, loader, settings, hooks=hooks, done=progress.done)


def _follow(adapted: AdaptedModel, settings: PosttrainingConfig, done: int, steps_of_an_epoch: int) -> None:
    """The old policy after a step (spec/model.md 8), or after an epoch."""
    if not settings.old_policy.each_epoch or done % steps_of_an_epoch == 0:
        adapted.follow(min(settings.old_policy.decay_per_step * done, settings.old_policy.most))


def _finish(
    config: PosttrainRunConfig,
    out: Path,
    adapted: AdaptedModel,
    card: ModelCard,
    release: Release,
    queries: list[Query],
    merge: bool,
    quiet: bool,
) -> dict[str, object]:
    draw_curves(out)
    write_rollouts(out / ROLLOUTS_TABLE, read_rows(out / "rollouts", 1 << 62), release.digest)
    adapted.save(out / ADAPTER)
    found = measure_both(adapted, queries, config, quiet) if queries else {}
    write_text(out / "evaluation.json", json.dumps(found, indent=1) + "\n")
    if merge:
        merged = adapted.merged()
        releases = tuple(sorted({*card.releases, release.digest}))
        save_model(out / MODEL, merged, replace(card, config=merged.config, releases=releases))
    return found


def _identity(config: PosttrainRunConfig, card: ModelCard, loader: QueryLoader) -> dict[str, object]:
    """What checkpoints of a run must agree on; the loader's own state covers selection and order."""
    settings = json.loads(json.dumps(dataclasses.asdict(config.posttraining)))
    for name in _NOT_PART_OF_A_RUN:
        del settings[name]
    return {"model": card.weights_sha256, "posttraining": settings, "steps_of_an_epoch": loader.steps}
