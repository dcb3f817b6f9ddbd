"""The model on one GPU: what a processor cannot show, in at most nine minutes.

Flex attention beside the blocks of a processor, in outputs and gradients; bfloat16 beside float32; speed, share of the
peak and memory of a training step of `small`, and of as many layers of `wsm5b` as fit; seconds of a planning step with
random weights of `wsm5b`. It needs torch, numpy, safetensors, and this repository, which it finds by itself. Run as
`python bench/gpu.py`; what there is no time for is left out by name. `--device cpu` tries the script on tiny shapes.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import torch
from reporting import RESULTS, machine, machine_line, table, write_results
from torch import Tensor

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.config import ModelConfig
from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Session, SessionConfig
from wsm_model.inputs import ModelInputs, ModelOutputs
from wsm_model.layers.pose import identity_poses
from wsm_model.losses.total import LossConfig, pretraining_loss
from wsm_model.model import Attention, WorldSlamModel
from wsm_model.mot.compiled import compile_blocks
from wsm_model.precision import Precision, autocast, matrices
from wsm_model.presets import preset
from wsm_model.training.config import OptimiserConfig
from wsm_model.training.schedule import make_optimiser
from wsm_model.training.work import speed, work_of

BUDGET_S = 400.0
"""After so long nothing more is begun; the longest part takes about a minute."""
CHUNK = 4
GIB = 2.0**30


@dataclass(frozen=True, kw_only=True)
class Scale:
    """How large everything is.

    Attributes:
        compared: model whose attentions are compared.
        trained: models whose steps are timed, by name, with rows and latents of a row.
        planned: model whose planning steps are timed.
        histories: latents that were seen before.
        steps: that are timed, after two that are not.
    """

    compared: ModelConfig
    trained: dict[str, tuple[ModelConfig, int, int]]
    planned: ModelConfig
    histories: tuple[int, ...]
    steps: int


def scale_of(device: torch.device) -> Scale:
    tiny = replace(preset("tiny", latent_height=4, latent_width=6), layers=2)
    if device.type != "cuda":
        return Scale(compared=tiny, trained={"tiny": (tiny, 1, 5)}, planned=tiny, histories=(2,), steps=1)
    large = preset("wsm5b")
    with torch.device("meta"):
        of_layer = sum(one.numel() for one in WorldSlamModel(replace(large, layers=1)).layers.parameters())
    room = torch.cuda.get_device_properties(device).total_memory
    layers = max(1, min(large.layers, int(0.6 * room / (16 * of_layer))))
    return Scale(
        compared=replace(preset("small"), layers=2),
        trained={
            "small": (preset("small"), 4, 44),
            f"{layers} layers of wsm5b": (replace(large, layers=layers), 1, 44),
        },
        planned=large,
        histories=(32, 120),
        steps=5,
    )


def inputs_of(config: ModelConfig, rows: int, latents: int, device: torch.device) -> ModelInputs:
    shape = (rows, latents, config.latent_channels, config.latent_height, config.latent_width)
    generator = torch.Generator(device).manual_seed(0)
    rgb, depth, noisy = (torch.randn(shape, generator=generator, device=device) for _ in range(3))
    return ModelInputs(
        rgb=rgb,
        depth=depth,
        poses=identity_poses(rows, latents, config.pose_slots, device=device),
        goal_camera0_m=torch.ones(rows, 3, device=device),
        noisy_rgb=noisy,
        flow_time=torch.full((rows, latents), 0.5, device=device),
        spans=tuple(SequenceSpan(row=row, start=0, length=latents, chunk_size=1 + row % CHUNK) for row in range(rows)),
    )


def loss_of(inputs: ModelInputs, outputs: ModelOutputs) -> Tensor:
    return pretraining_loss(inputs, outputs, inputs.noisy_rgb, LossConfig()).total


def model_of(config: ModelConfig, attention: Attention, device: torch.device) -> WorldSlamModel:
    torch.manual_seed(0)
    with torch.device(device):
        return WorldSlamModel(config, attention)


def relative(found: Tensor, wanted: Tensor) -> float:
    """Largest difference, as a share of the largest number."""
    return float((found - wanted).abs().max() / wanted.abs().max().clamp(min=1e-30))


def passed(config: ModelConfig, attention: Attention, precision: Precision, device: torch.device, backward: bool):
    """Velocities, and all gradients in one row."""
    model, inputs = model_of(config, attention, device), inputs_of(config, 2, 12, device)
    with autocast(precision, device), torch.set_grad_enabled(backward):
        outputs = model(inputs)
    if not backward:
        return outputs.velocity.float(), torch.zeros(1)
    loss_of(inputs, outputs).backward()
    gradients = [one.grad.flatten() for one in model.parameters() if one.grad is not None]
    return outputs.velocity.detach().float(), torch.cat(gradients)


def compare(scale: Scale, device: torch.device) -> list[list[str]]:
    """Outputs and gradients of ways to evaluate the attention; on a processor flex_attention has no backward pass."""
    backward = device.type == "cuda"
    rows = []
    wanted = passed(scale.compared, Attention.BLOCKS, Precision.FLOAT32, device, backward)
    for attention, precision in ((Attention.FLEX, Precision.FLOAT32), (Attention.FLEX, Precision.BFLOAT16)):
        found = passed(scale.compared, attention, precision, device, backward)
        gradients = f"{relative(found[1], wanted[1]):.1e}" if backward else "-"
        rows.append([f"{attention}, {precision}", f"{relative(found[0], wanted[0]):.1e}", gradients])
    return rows


def training(scale: Scale, device: torch.device, peak_tflops: float, name: str, *, compiled: bool) -> list[str]:
    """A step of forward, backward and AdamW, layers recomputed, in bfloat16."""
    config, rows, latents = scale.trained[name]
    clear(device)
    model, inputs = model_of(config, Attention.AUTO, device), inputs_of(config, rows, latents, device)
    model.checkpoint_activations = True
    if compiled:
        compile_blocks(model)
    optimiser = make_optimiser(model, OptimiserConfig())

    def step() -> None:
        optimiser.zero_grad(set_to_none=True)
        with autocast(Precision.BFLOAT16, device):
            outputs = model(inputs)
        loss_of(inputs, outputs).backward()
        optimiser.step()

    seconds = median_seconds(step, scale.steps, device)
    done = speed(work_of(model, inputs.spans), seconds)
    return [
        f"{name}, {rows} x {latents} latents{', compiled' if compiled else ''}",
        f"{seconds:.3f}",
        f"{done['latents_per_second']:.1f}",
        f"{done['tokens_per_second']:,.0f}",
        f"{done['tflop_per_second']:.1f}",
        f"{done['tflop_per_second'] / peak_tflops:.1%}" if device.type == "cuda" else "-",
        peak_gib(device),
    ]


@torch.no_grad()
def planning(scale: Scale, device: torch.device, latents: int) -> list[str]:
    """One latent observed and four dreamed in eight steps, after so many latents, with random weights in bfloat16."""
    config = scale.planned
    clear(device)
    with torch.device("meta"):
        model = WorldSlamModel(config)
    rounded = matrices(model)
    weights = {
        name: 0.02 * torch.randn(one.shape, device=device, dtype=torch.bfloat16 if name in rounded else torch.float32)
        for name, one in model.named_parameters()
    }
    model.load_state_dict(weights, assign=True)
    shape = (config.latent_channels, config.latent_height, config.latent_width)
    seen = torch.randn(latents + scale.steps + 2, *shape, device=device)
    session = Session(model.eval(), SessionConfig(chunk_size=CHUNK, cache_latents=len(seen) + CHUNK))
    episode = session.start()
    session.observe_all(episode, seen[:latents])
    goal, noise = torch.ones(1, 3, device=device), torch.randn(1, 1, CHUNK, *shape, device=device)
    coming = iter(seen[latents:])

    def plan() -> None:
        session.observe([episode], next(coming)[None])
        session.dream([episode], goal, noise, flow_schedule(8, 5.0))

    return [str(latents), f"{median_seconds(plan, scale.steps, device):.3f}", peak_gib(device)]


def median_seconds(work: Callable[[], None], times: int, device: torch.device) -> float:
    """Of some runs, after two that pay for compilation and memory."""
    found = []
    for _ in range(2 + times):
        start = time.perf_counter()
        work()
        if device.type == "cuda":
            torch.cuda.synchronize(device)
        found.append(time.perf_counter() - start)
    return statistics.median(found[2:])


def clear(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.empty_cache()
        torch.cuda.reset_peak_memory_stats(device)


def peak_gib(device: torch.device) -> str:
    return f"{torch.cuda.max_memory_allocated(device) / GIB:.1f}" if device.type == "cuda" else "-"


def main() -> None:
    given = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    given.add_argument("--device", default="cuda", choices=("cuda", "cpu"))
    given.add_argument("--peak-tflops", type=float, default=989.0, help="bfloat16, dense; 989: H100 SXM and H200")
    given.add_argument("--out", type=Path, default=RESULTS, help="folder of gpu.md and gpu.json")
    options = given.parse_args()
    if options.device == "cuda" and not torch.cuda.is_available():
        print("torch finds no GPU here: nothing is measured; --device cpu tries the script")  # `make bench` goes on
        return
    device = torch.device(options.device)
    scale = scale_of(device)
    plans: list[tuple[str, Callable[[], list[str]]]] = [
        *(
            (f"step of {name}", partial(training, scale, device, options.peak_tflops, name, compiled=False))
            for name in scale.trained
        ),
        *((f"planning after {one} latents", partial(planning, scale, device, one)) for one in scale.histories),
    ]
    if device.type == "cuda":
        first = next(iter(scale.trained))
        plans.append(("compiled step", partial(training, scale, device, options.peak_tflops, first, compiled=True)))
    start = time.perf_counter()
    compared = compare(scale, device)
    measured, left_out = [], []
    for name, plan in plans:
        if time.perf_counter() - start > BUDGET_S:
            left_out.append(name)
        else:
            measured.append(plan())
    what = torch.cuda.get_device_name(device) if device.type == "cuda" else "a processor, tiny shapes: only a trial"
    setup = machine("torch", "numpy", "safetensors")
    record = {"machine": setup, "device": what, "compared": compared, "measured": measured, "left_out": left_out}
    lines = page(what, compared, measured, left_out, options.peak_tflops)
    write_results("gpu", record, [*lines, "", machine_line(setup)], options.out)


def page(
    what: str, compared: list[list[str]], measured: list[list[str]], left_out: list[str], peak_tflops: float
) -> list[str]:
    steps, plans = ([row for row in measured if (len(row) > 3) is is_step] for is_step in (True, False))
    return [
        "# The model on a GPU",
        "",
        f"On {what}. Largest differences from blocks of the mask in float32, as a share of the largest number:",
        "",
        *table(["attention, precision", "velocities", "gradients"], compared),
        "",
        f"Training steps in bfloat16, layers recomputed; MFU at {peak_tflops:g} TFLOP/s, of the model alone:",
        "",
        *table(["model", "s", "latents/s", "tokens/s", "TFLOP/s", "MFU", "GiB"], steps),
        "",
        "A planning step (one latent observed, four dreamed in eight steps), random weights in bfloat16:",
        "",
        *table(["latents seen", "s", "GiB"], plans),
        *(["", f"No time was left for: {', '.join(left_out)}."] if left_out else []),
    ]


if __name__ == "__main__":
    main()
