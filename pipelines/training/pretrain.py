"""A training run in its folder: started, or gone on with, and evaluated at its end.

RUN/run.json            settings, resolved
RUN/metrics.jsonl       a line per logged step
RUN/tensorboard/        the same for TensorBoard
RUN/checkpoints/        step-000500/ ...
RUN/ledger/             which step saw which clip
RUN/samples/            dreams and estimates beside the truth
RUN/curves.png
RUN/model/              model.safetensors and model.json, at the end
RUN/evaluation.json     errors on held-out clips, at the end
"""

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import torch
from tqdm import tqdm

from pipelines.running.folder import locked
from pipelines.running.full_disk import full_disk_named
from pipelines.running.interrupts import termination_noted
from pipelines.training.config import TrainRunConfig
from pipelines.training.data import decoding_of, held_out_loader, model_config, training_loader
from pipelines.training.evaluation import curve_values, evaluate, held_out_errors
from pipelines.training.pictures import draw_curves, draw_dream
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import digest_json
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.loader import ClipLoader
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import ModelConfig
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.summary import summarise
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import ModelCard, load_model, save_model
from wsm_model.ranks import leave_ranks, rank_and_world_size, shard_model, start_ranks, unsharded, wait_for_all
from wsm_model.training.checkpoint import checkpoints
from wsm_model.training.loop import Hooks, TrainingRun, resume, total_steps, train
from wsm_model.training.metrics import MetricsWriter, metrics_writer
from wsm_model.training.pretraining import pretraining_step
from wsm_model.training.schedule import make_optimiser
from wsm_model.weights.from_wan import load_wan_weights

_NOT_PART_OF_A_RUN = (
    "epochs",
    "max_steps",
    "checkpoint_every",
    "keep_checkpoints",
    "log_every",
    "sample_every",
    "micro_rows",
)
"""Settings of training that may change between two parts of a run: none of them changes what a step learns.

A run that is to go on for longer follows the schedule of its new length from where it stands.
"""


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
            return _run(config, out, device, quiet)
    finally:
        leave_ranks()


def identity_of(
    config: TrainRunConfig, loader: ClipLoader, shape: ModelConfig, standard: LatentStandard
) -> dict[str, object]:
    """What checkpoints of a run must agree on, by dotted name; the loader's own state covers data and order."""
    training = {
        name: value for name, value in dataclasses.asdict(config.training).items() if name not in _NOT_PART_OF_A_RUN
    }
    parts = {
        "model": dataclasses.asdict(config.model),
        "shape": dataclasses.asdict(shape),
        "latent_standard": digest_json(dataclasses.asdict(standard)),
        "training": training,
        "dtype_of_latents": config.read.dtype,
        "steps_of_an_epoch": loader.steps,
    }
    return dict(_dotted(json.loads(json.dumps(parts))))


def _run(config: TrainRunConfig, out: Path, device: torch.device, quiet: bool) -> str | None:
    _require_decodable(config)
    rank, world_size = rank_and_world_size()
    with training_loader(config, device, str(out / "ledger"), rank, world_size) as loader:
        release = loader.sources.tables[0].release
        torch.manual_seed(config.training.seed)
        model = WorldSlamModel(model_config(config, release.manifest), config.model.attention).to(device)
        identity = identity_of(config, loader, model.config, latent_standard(release.manifest))
        if config.model.weights and not checkpoints(out / "checkpoints"):
            _fill_with_wan(config, out, model)
        shard_model(model, device)
        run = TrainingRun(
            model=model,
            optimiser=make_optimiser(model, config.training.optimiser),
            folder=out / "checkpoints",
            identity=identity,
        )
        done = resume(run, loader)
        if rank == 0:  # only now is it certain that the folder is this run's
            write_text(out / "run.json", json.dumps(dataclasses.asdict(config), indent=1, sort_keys=True) + "\n")
        with (
            termination_noted() as must_stop,
            _hooks(config, out, model, done, total_steps(config.training, loader), device, quiet, must_stop) as hooks,
        ):
            model.checkpoint_activations = config.training.checkpoint_activations
            model.train()
            step = partial(pretraining_step, model, run, config.training)
            train(run, step, loader, config.training, hooks=hooks, done=done)
        card = ModelCard(
            config=model.config,
            standard=latent_standard(release.manifest),
            releases=tuple(sorted({table.release.digest for table in loader.sources.tables})),
            steps=total_steps(config.training, loader),
        )
    save_model(out / "model", model, card)
    if rank:
        return None
    draw_curves(out)
    return _evaluate(config, out, device, quiet)


def _fill_with_wan(config: TrainRunConfig, out: Path, model: WorldSlamModel) -> None:
    """Start from pretrained weights, and say what became of each tensor."""
    report = load_wan_weights(model, config.model.weights)
    rank, _ = rank_and_world_size()
    if rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        write_text(out / "weights.json", json.dumps(dataclasses.asdict(report), indent=1) + "\n")
        tqdm.write(report.summary())


@contextmanager
def _hooks(
    config: TrainRunConfig,
    out: Path,
    model: WorldSlamModel,
    done: int,
    steps: int,
    device: torch.device,
    quiet: bool,
    must_stop: Callable[[], bool],
) -> Iterator[Hooks]:
    """Metrics, pictures and the progress bar, of the first rank; the others only take part in what is sampled."""
    rank, _ = rank_and_world_size()
    if rank:

        def unheard(step: int, values: Mapping[str, float]) -> None:
            """Metrics are the first rank's to write."""

        sample = _sampler(config, out, model, device, unheard)
        yield Hooks(metrics=unheard, sample=sample, progress=lambda _done: None, must_stop=must_stop)
        return
    with (
        metrics_writer(out, done) as write,
        tqdm(total=steps, initial=done, unit="step", desc="train", disable=quiet, dynamic_ncols=True) as bar,
    ):

        def show(step: int, values: Mapping[str, float]) -> None:
            write(step, values)
            bar.set_postfix(loss=f"{values['loss']:.4f}", refresh=False)

        def progress(now: int) -> None:
            bar.update(now - bar.n)

        sample = _sampler(config, out, model, device, write)
        yield Hooks(metrics=show, sample=sample, progress=progress, must_stop=must_stop)


def _sampler(
    config: TrainRunConfig, out: Path, model: WorldSlamModel, device: torch.device, write: MetricsWriter
) -> Callable[[int], None]:
    """What measures held-out clips after a step, and draws the first and the curves; what it needs is opened now."""
    if not config.training.sample_every:
        return lambda _step: None
    rank, _ = rank_and_world_size()
    batches, decoding = _first_held_out(config, device), _decoding(config)
    shift = config.training.loss.flow_shift

    def sample(step: int) -> None:
        was_training = model.training
        model.eval()
        path = out / "samples" / f"step-{step:06d}.png" if rank == 0 else None
        with unsharded(model):
            draw_dream(model, batches[0], decoding, config.held_out, path, shift=shift, title=f"after step {step}")
            errors = held_out_errors(model, batches, config.held_out, decoding=decoding, shift=shift, quiet=True)
        model.train(was_training)
        write(step, curve_values(summarise(errors)))
        if rank == 0:
            draw_curves(out)
        wait_for_all()

    return sample


def _first_held_out(config: TrainRunConfig, device: torch.device) -> list[Batch]:
    loader = held_out_loader(config, device)
    if loader is None:
        raise ConfigError(
            f"pictures need a clip of the split {config.held_out.split!r}, but the release has none; choose another "
            "held_out.split, or set training.sample_every=0"
        )
    with loader:
        return list(islice(loader, config.held_out.sampled_clips))


def _require_decodable(config: TrainRunConfig) -> None:
    """Whatever is measured or drawn is decoded: say before the first step, not after the last, that it cannot be.

    Raises:
        ConfigError: the codec of the release cannot be built.
    """
    if not (config.held_out.clips or config.training.sample_every):
        return
    try:
        _decoding(config)
    except ConfigError as error:
        raise ConfigError(
            f"{error}. Held-out clips are measured on decoded frames: name the weights in codec_weights, or set "
            "held_out.clips=0 and training.sample_every=0"
        ) from error


def _decoding(config: TrainRunConfig) -> Decoding:
    return decoding_of(open_release(config.sources[0].release).manifest, config.codec_weights)


def _evaluate(config: TrainRunConfig, out: Path, device: torch.device, quiet: bool) -> str:
    loader = held_out_loader(config, device) if config.held_out.clips else None
    if loader is None:
        return ""
    with loader:
        standard = latent_standard(loader.sources.tables[0].release.manifest)
        model, _ = load_model(out / "model", standard)
        shift = config.training.loss.flow_shift
        return evaluate(
            model.to(device),
            loader,
            config.held_out,
            out / "evaluation.json",
            decoding=_decoding(config),
            shift=shift,
            quiet=quiet,
        )


def _dotted(parts: Mapping[str, Any], where: str = "") -> Iterator[tuple[str, object]]:
    for name, value in parts.items():
        dotted = f"{where}{name}"
        if isinstance(value, Mapping):
            yield from _dotted(value, f"{dotted}.")
        else:
            yield dotted, value
