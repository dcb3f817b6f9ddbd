"""What a run tells and draws on its way: metrics, progress bar, pictures, and errors on held-out clips."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import torch
from tqdm import tqdm

from pipelines.training.config import TrainRunConfig
from pipelines.training.data import decoding_of, held_out_loader
from pipelines.training.evaluation import curve_values, evaluate, held_out_errors
from pipelines.training.pictures import draw_curves, draw_dream
from pipelines.training.start import StartedRun
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import Batch
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.summary import summarise
from wsm_model.model import WorldSlamModel
from wsm_model.ranks import rank_and_world_size, wait_for_all, whole_model
from wsm_model.training.average import averaged
from wsm_model.training.loop import Hooks
from wsm_model.training.metrics import MetricsWriter, metrics_writer
from wsm_model.training.profile import profiled


@contextmanager
def run_hooks(
    config: TrainRunConfig,
    out: Path,
    started: StartedRun,
    *,
    done: int,
    device: torch.device,
    quiet: bool,
    must_stop: Callable[[], bool],
) -> Iterator[Hooks]:
    """Metrics, pictures and the progress bar, of the first rank; the others take part in what is measured and drawn."""
    rank, world_size = rank_and_world_size()
    if rank:

        def unheard(step: int, values: Mapping[str, float]) -> None:
            """Metrics are the first rank's to write."""

        yield Hooks(
            metrics=unheard,
            sample=_sampler(config, out, started, device, unheard),
            evaluate=_evaluator(config, out, started, device, unheard),
            progress=lambda _done: None,
            must_stop=must_stop,
        )
        return
    peak_tflops = world_size * config.hardware.peak_tflops
    with (
        metrics_writer(out, done) as write,
        profiled(out / "profile", config.training.profile_steps) as tick,
        tqdm(
            total=started.card.steps, initial=done, unit="step", desc="train", disable=quiet, dynamic_ncols=True
        ) as bar,
    ):

        def show(step: int, values: Mapping[str, float]) -> None:
            told = with_mfu(values, peak_tflops) if device.type == "cuda" else values
            write(step, told)
            bar.set_postfix(progress_words(told), refresh=False)

        def progress(now: int) -> None:
            bar.update(now - bar.n)
            tick()

        yield Hooks(
            metrics=show,
            sample=_sampler(config, out, started, device, write),
            evaluate=_evaluator(config, out, started, device, write),
            progress=progress,
            must_stop=must_stop,
        )


def with_mfu(values: Mapping[str, float], peak_tflops: float) -> dict[str, float]:
    """Metrics with the share of the peak that the model's operations reach, 0 to 1."""
    return {**values, "mfu": values["tflop_per_second"] / peak_tflops}


def progress_words(values: Mapping[str, float]) -> dict[str, str]:
    """What of a step's metrics stands beside the progress bar."""
    wait = values["data_wait_seconds"] / (values["seconds"] + values["data_wait_seconds"])
    return {
        "loss": f"{values['loss']:.4f}",
        "latents/s": f"{values['latents_per_second']:.3g}",
        **({"MFU": f"{values['mfu']:.0%}"} if "mfu" in values else {}),
        "GiB": f"{values['peak_memory_gib']:.1f}",
        "wait": f"{wait:.0%}",
    }


def evaluate_whole(config: TrainRunConfig, path: Path, model: WorldSlamModel, device: torch.device, quiet: bool) -> str:
    """Errors of a whole model on held-out clips, shared among the ranks and written to `path` by the first.

    Returns:
        The table of means on the first rank; empty elsewhere, and where there are no such clips.
    """
    loader = held_out_loader(config, device) if config.held_out.clips else None
    if loader is None:
        return ""
    with loader:
        return evaluate(
            model,
            loader,
            config.held_out,
            path,
            decoding=decoding(config),
            shift=config.training.loss.flow_shift,
            quiet=quiet,
        )


def require_decodable(config: TrainRunConfig) -> None:
    """Whatever is measured or drawn is decoded: say before the first step, not after the last, that it cannot be.

    Raises:
        ConfigError: the codec of the release cannot be built.
    """
    if not (config.held_out.clips or config.training.sample_every):
        return
    try:
        decoding(config)
    except ConfigError as error:
        raise ConfigError(
            f"{error}. Held-out clips are measured on decoded frames: name the weights in codec_weights, or set "
            "held_out.clips=0 and training.sample_every=0"
        ) from error


def decoding(config: TrainRunConfig) -> Decoding:
    """What turns latents of the first source into pictures."""
    manifest = open_release(config.sources[0].release).manifest
    return decoding_of(manifest, config.codec_weights, config.read.standard)


def _sampler(
    config: TrainRunConfig, out: Path, started: StartedRun, device: torch.device, write: MetricsWriter
) -> Callable[[int], None]:
    """What measures held-out clips after a step, and draws the first and the curves; what it needs is opened now."""
    if not config.training.sample_every:
        return lambda _step: None
    rank, _ = rank_and_world_size()
    batches, decoded = _first_held_out(config, device), decoding(config)
    shift = config.training.loss.flow_shift

    def sample(step: int) -> None:
        with averaged(started.model, started.run.average), whole_model(started.model) as model:
            if rank == 0:
                path = out / "samples" / f"step-{step:06d}.png"
                draw_dream(model, batches[0], decoded, config.held_out, path, shift=shift, title=f"after step {step}")
            errors = held_out_errors(model, batches, config.held_out, decoding=decoded, shift=shift, quiet=True)
        write(step, curve_values(summarise(errors)))
        if rank == 0:
            draw_curves(out)
        wait_for_all()

    return sample


def _evaluator(
    config: TrainRunConfig, out: Path, started: StartedRun, device: torch.device, write: MetricsWriter
) -> Callable[[int], None]:
    """What measures all held-out clips after a step, as at the end, and adds the means to the curves."""
    rank, _ = rank_and_world_size()

    def measure(step: int) -> None:
        path = out / "evaluations" / f"step-{step:06d}.json"
        with averaged(started.model, started.run.average), whole_model(started.model) as model:
            evaluate_whole(config, path, model, device, quiet=True)
        if rank == 0 and path.is_file():
            write(step, curve_values(json.loads(path.read_text())))
        wait_for_all()

    return measure


def _first_held_out(config: TrainRunConfig, device: torch.device) -> list[Batch]:
    loader = held_out_loader(config, device)
    if loader is None:
        raise ConfigError(
            f"pictures need a clip of the split {config.held_out.split!r}, but the release has none; choose another "
            "held_out.split, or set training.sample_every=0"
        )
    with loader:
        return list(islice(loader, config.held_out.sampled_clips))
