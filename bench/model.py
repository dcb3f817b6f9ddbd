"""What the structure of the mask and the cache are worth: training and planning steps against the length of a clip.

Training: one step (forward, losses, backward) on one sequence, blocks of the mask against the dense matrix. Planning:
one new latent observed, four dreamed in eight steps, their states estimated; with the cache of all that was seen
before, against a new session that is given the whole history first. Layers and widths are cut down so that 128
latents fit a short run: the ratios are those of the structure. Run as `python bench/model.py`.
"""

import json
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from reporting import machine, machine_line, table, write_results

ROUNDS = 3
TRAINING_LATENTS = (8, 16, 32, 64, 128)
HISTORY_LATENTS = (4, 8, 16, 32, 64, 128)
CHUNK = 4
DREAM_STEPS = 8
_LATENT_CELLS = (6, 10)


def _model(attention: str):
    import torch

    from wsm_model.model import Attention, WorldSlamModel
    from wsm_model.presets import preset

    torch.set_num_threads(1)
    torch.manual_seed(0)
    height, width = _LATENT_CELLS
    config = replace(preset("tiny", latent_height=height, latent_width=width), layers=2)
    return WorldSlamModel(config, Attention(attention))


def _latents(*shape: int):
    import torch

    return torch.randn(*shape, 48, *_LATENT_CELLS, generator=torch.Generator().manual_seed(0))


def _seconds(work: Callable[[], None]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _operations(work: Callable[[], None]) -> dict[str, float]:
    """Floating-point operations of all matrix products, and of those in attention, in units of 1e9."""
    import torch
    from torch.utils.flop_counter import FlopCounterMode, sdpa_backward_flop_count, sdpa_flop_count

    # torch counts its GPU kernels of attention; the one on a CPU takes the same first arguments.
    on_cpu = {
        torch.ops.aten._scaled_dot_product_flash_attention_for_cpu: lambda *shapes, **_: sdpa_flop_count(*shapes[:3]),
        torch.ops.aten._scaled_dot_product_flash_attention_for_cpu_backward: lambda *shapes, **_: (
            sdpa_backward_flop_count(*shapes[:4])
        ),
    }
    with FlopCounterMode(display=False, custom_mapping=on_cpu) as counter:
        work()
    counts = counter.get_flop_counts()["Global"]
    attention = sum(count for name, count in counts.items() if "attention" in str(name))
    return {"gflop": sum(counts.values()) / 1e9, "attention_gflop": attention / 1e9}


def training_step(attention: str, latents: int) -> dict[str, float]:
    """Seconds of a step and the growth of peak memory, in this process."""
    import torch

    from wsm_data.schema.sequence import SequenceSpan
    from wsm_model.inputs import ModelInputs
    from wsm_model.layers.pose import identity_poses
    from wsm_model.losses.total import LossConfig, pretraining_loss

    model, rgb = _model(attention), _latents(1, latents)
    inputs = ModelInputs(
        rgb=rgb,
        depth=rgb,
        poses=identity_poses(1, latents, 4),
        goal_camera0_m=torch.zeros(1, 3),
        noisy_rgb=rgb,
        flow_time=torch.full((1, latents), 0.5),
        spans=(SequenceSpan(row=0, start=0, length=latents, chunk_size=CHUNK),),
    )

    def step() -> None:
        pretraining_loss(inputs, model(inputs), rgb, LossConfig()).total.backward()

    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = min(_seconds(step) for _ in range(2))  # the first pays for what is allocated once
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
    return {"seconds": seconds, "memory_mb": grown_kb / 1024, **_operations(step)}


def planning_steps(history: int) -> dict[str, float]:
    """Seconds of a planning step with the cache and in a new session, in this process."""
    import torch

    from wsm_model.inference.sampler import flow_schedule
    from wsm_model.inference.session import Episode, Session, SessionConfig

    model, seen = _model("blocks").eval(), _latents(1, history + 1)
    schedule, noise, goal = flow_schedule(DREAM_STEPS, 5.0), _latents(1, 1, CHUNK), torch.zeros(1, 3)

    session = Session(model, SessionConfig(chunk_size=CHUNK, cache_latents=history + CHUNK + 1))

    def observed(latents: int) -> Episode:
        episode = session.start()
        for number in range(latents):
            session.observe([episode], seen[:, number])
        return episode

    def plan(episode: Episode) -> None:
        session.observe([episode], seen[:, history])
        session.dream([episode], goal, noise, schedule)

    def recompute() -> None:
        plan(observed(history))

    found: dict[str, float] = {}
    for name, prepare in (("cached", lambda: partial(plan, observed(history))), ("recomputed", lambda: recompute)):
        found[name] = min(_seconds(prepare()) for _ in range(2))
        found[f"{name}_gflop"] = _operations(prepare())["gflop"]
    return found


def in_new_process(*words: str) -> dict[str, float]:
    """Run one measurement by itself: memory that another one touched would not count again."""
    done = subprocess.run([sys.executable, __file__, *words], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def measure() -> dict[str, dict[str, list[dict[str, float]]]]:
    training: dict[str, list[dict[str, float]]] = {}
    planning: dict[str, list[dict[str, float]]] = {}
    for _ in range(ROUNDS):
        for latents in TRAINING_LATENTS:
            for attention in ("blocks", "dense"):
                training.setdefault(f"{attention} {latents}", []).append(
                    in_new_process("training", attention, str(latents))
                )
        for history in HISTORY_LATENTS:
            planning.setdefault(str(history), []).append(in_new_process("planning", str(history)))
    return {"training": training, "planning": planning}


def middle(runs: list[dict[str, float]], name: str) -> float:
    return statistics.median(run[name] for run in runs)


def spread(ratios: list[float]) -> str:
    return f"{statistics.median(ratios):.2f} x ({min(ratios):.2f} to {max(ratios):.2f})"


def page(found: dict[str, dict[str, list[dict[str, float]]]]) -> list[str]:
    training, planning = found["training"], found["planning"]
    height, width = _LATENT_CELLS
    return [
        "# The model: what the structure of the mask and the cache are worth",
        "",
        f"Two layers of the size `tiny`, latents of {height} x {width} cells, chunks of {CHUNK}, float32, one thread, "
        f"every measurement in a process of its own; medians of {ROUNDS} interleaved rounds, with the range of the "
        "ratios. Operations are those of all matrix products, as torch counts them.",
        "",
        "## A training step: blocks of the mask (what runs on a CPU) beside the dense matrix",
        "",
        *table(
            [
                "latents",
                "blocks, s",
                "dense, s",
                "dense takes",
                "blocks, GFLOP",
                "dense, GFLOP",
                "of attention",
                "blocks, MB",
                "dense, MB",
            ],
            [training_row(latents, training) for latents in TRAINING_LATENTS],
        ),
        "",
        f"## A planning step: one latent observed, {CHUNK} dreamed in {DREAM_STEPS} steps, their states estimated",
        "",
        *table(
            [
                "latents seen before",
                "with the cache, ms",
                "recomputed, ms",
                "recomputing takes",
                "with the cache, GFLOP",
                "recomputed, GFLOP",
            ],
            [planning_row(history, planning[str(history)]) for history in HISTORY_LATENTS],
        ),
        "",
        growth(planning),
    ]


def training_row(latents: int, training: dict[str, list[dict[str, float]]]) -> list[str]:
    blocks, dense = training[f"blocks {latents}"], training[f"dense {latents}"]
    attention = middle(dense, "attention_gflop") / middle(blocks, "attention_gflop")
    return [
        str(latents),
        f"{middle(blocks, 'seconds'):.3f}",
        f"{middle(dense, 'seconds'):.3f}",
        spread([slow["seconds"] / fast["seconds"] for slow, fast in zip(dense, blocks, strict=True)]),
        f"{middle(blocks, 'gflop'):.1f}",
        f"{middle(dense, 'gflop'):.1f}",
        f"{attention:.2f} x",
        f"{middle(blocks, 'memory_mb'):.0f}",
        f"{middle(dense, 'memory_mb'):.0f}",
    ]


def planning_row(history: int, runs: list[dict[str, float]]) -> list[str]:
    return [
        str(history),
        f"{1e3 * middle(runs, 'cached'):.0f}",
        f"{1e3 * middle(runs, 'recomputed'):.0f}",
        spread([run["recomputed"] / run["cached"] for run in runs]),
        f"{middle(runs, 'cached_gflop'):.2f}",
        f"{middle(runs, 'recomputed_gflop'):.2f}",
    ]


def growth(planning: dict[str, list[dict[str, float]]]) -> str:
    """A line through the times of a cached step, and how far the worst of them lies from it."""
    history = np.array(HISTORY_LATENTS, float)
    times_ms = np.array([1e3 * middle(planning[str(latents)], "cached") for latents in HISTORY_LATENTS])
    slope_ms, start_ms = np.polyfit(history, times_ms, 1)
    off = np.abs(times_ms - (start_ms + slope_ms * history)) / times_ms
    return (
        f"The cached step grows linearly: {start_ms:.0f} ms + {slope_ms:.2f} ms a latent seen before; the farthest of "
        f"the {len(history)} times lies {100 * off.max():.0f} % off that line."
    )


def main() -> None:
    if sys.argv[1:2] == ["training"]:
        print(json.dumps(training_step(sys.argv[2], int(sys.argv[3]))))
    elif sys.argv[1:2] == ["planning"]:
        print(json.dumps(planning_steps(int(sys.argv[2]))))
    else:
        found, setup = measure(), machine("torch")
        write_results("model", {"machine": setup, **found}, [*page(found), "", machine_line(setup)])


if __name__ == "__main__":
    main()
