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
from dataclasses import replace

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


def training_step(attention: str, latents: int) -> dict[str, float]:
    """Seconds of a step and the growth of peak memory, in this process."""
    import torch

    from wsm_model.inputs import ModelInputs
    from wsm_model.layers.pose import identity_poses
    from wsm_model.losses.total import LossConfig, pretraining_loss
    from wsm_model.mot.attention_blocks import plan_blocks
    from wsm_model.mot.chunks import SequenceSpan

    model, rgb = _model(attention), _latents(1, latents)
    spans = (SequenceSpan(row=0, start=0, length=latents, chunk_size=CHUNK),)
    inputs = ModelInputs(
        rgb=rgb,
        depth=rgb,
        poses=identity_poses(1, latents, 4),
        goal_camera0_m=torch.zeros(1, 3),
        noisy_rgb=rgb,
        flow_time=torch.full((1, latents), 0.5),
        spans=spans,
    )
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times = []
    for _ in range(2):  # the first pays for what is allocated once
        start = time.perf_counter()
        pretraining_loss(inputs, model(inputs), rgb, LossConfig()).total.backward()
        times.append(time.perf_counter() - start)
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
    length = 2 * latents * sum(model.config.tokens.values())
    pairs = length**2 if attention == "dense" else _pairs(model.config, plan_blocks(model.config, spans, rgb.device))
    return {"seconds": min(times), "memory_mb": grown_kb / 1024, "pairs": pairs}


def _pairs(config, plan) -> int:
    """Pairs of tokens that the blocks evaluate."""
    from wsm_model.mot.mask import TokenKind

    rgb, state = config.patches, config.patches + config.pose_slots
    tokens = {
        TokenKind.CLEAN_RGB: rgb,
        TokenKind.NOISY_RGB: rgb,
        TokenKind.CLEAN_STATE: state,
        TokenKind.STATE_QUERY: state,
    }
    return sum(
        (block.frames.stop - block.frames.start)
        * tokens[block.kind]
        * sum((place.stop - place.start) * tokens[kind] for kind, place in block.seen)
        for block in plan[0].blocks
    )


def planning_steps(history: int) -> dict[str, float]:
    """Seconds of a planning step with the cache and in a new session, in this process."""
    import torch

    from wsm_model.inference.sampler import flow_schedule
    from wsm_model.inference.session import Session, SessionConfig

    model, seen = _model("blocks").eval(), _latents(1, history + 1)
    schedule, noise, goal = flow_schedule(DREAM_STEPS, 5.0), _latents(1, CHUNK), torch.zeros(1, 3)

    def observed(latents: int) -> Session:
        session = Session(model, SessionConfig(chunk_size=CHUNK, cache_latents=history + CHUNK + 1))
        for number in range(latents):
            session.observe(seen[:, number])
        return session

    def plan(session: Session) -> None:
        session.observe(seen[:, history])
        session.dream(goal, noise, schedule)

    session = observed(history)
    start = time.perf_counter()
    plan(session)
    cached = time.perf_counter() - start
    start = time.perf_counter()
    plan(observed(history))
    return {"cached": cached, "recomputed": time.perf_counter() - start}


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
    rows = []
    for latents in TRAINING_LATENTS:
        blocks, dense = training[f"blocks {latents}"], training[f"dense {latents}"]
        ratios = [slow["seconds"] / fast["seconds"] for slow, fast in zip(dense, blocks, strict=True)]
        rows.append(
            [
                str(latents),
                f"{middle(blocks, 'seconds'):.3f}",
                f"{middle(dense, 'seconds'):.3f}",
                spread(ratios),
                f"{middle(dense, 'pairs') / middle(blocks, 'pairs'):.2f} x",
                f"{middle(blocks, 'memory_mb'):.0f}",
                f"{middle(dense, 'memory_mb'):.0f}",
            ]
        )
    steps = []
    for history in HISTORY_LATENTS:
        runs = planning[str(history)]
        ratios = [run["recomputed"] / run["cached"] for run in runs]
        steps.append(
            [
                str(history),
                f"{1e3 * middle(runs, 'cached'):.0f}",
                f"{1e3 * middle(runs, 'recomputed'):.0f}",
                spread(ratios),
            ]
        )
    return [
        "# The model: what the structure of the mask and the cache are worth",
        "",
        f"Two layers of the size `tiny`, latents of {_LATENT_CELLS[0]} x {_LATENT_CELLS[1]} cells, chunks of {CHUNK}, "
        f"float32, one thread, every measurement in a process of its own; medians of {ROUNDS} interleaved rounds.",
        "",
        "## A training step",
        "",
        *table(
            [
                "latents",
                "blocks, s",
                "dense, s",
                "dense takes",
                "dense evaluates pairs",
                "blocks, MB",
                "dense, MB",
            ],
            rows,
        ),
        "",
        f"## A planning step: one latent observed, {CHUNK} dreamed in {DREAM_STEPS} steps, their states estimated",
        "",
        *table(["latents seen before", "with the cache, ms", "recomputed, ms", "recomputing takes"], steps),
    ]


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
