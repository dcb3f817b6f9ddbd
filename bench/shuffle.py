"""Quality of the shuffle against how locally it reads, for several sizes of blocks and windows.

Beside a full random permutation, which mixes as well as can be and reads everywhere, and reading in order, which is the
other end. The source is generated: 200 shards of 250 clips, in each shard clips of some 40 of 500 scenes. Each number
is the mean over four epochs:

- pairs kept: pairs of clips of one step that stood in one step of the epoch before, too; 1 is chance.
- neighbours: pairs of one step that stand next to one another in storage; 1 is chance.
- shards, scenes: different ones in a step, against those of a full permutation.
- correlation: of the place of a clip in storage with the step it is in (rank correlation, absolute); 0 is none.
- shards in 1000: different shards among 1000 consecutive clips of a rank.
- shards of a node: shards that a node with one eighth of the ranks reads in an epoch, as a multiple of its eighth; so
  many times its share of the bytes does it fetch where whole shards are fetched.

Run as `python bench/shuffle.py`; the picture is results/shuffle.png.
"""

from itertools import pairwise

import matplotlib
import numpy as np
from reporting import RESULTS, machine, machine_line, table, write_results

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.epoch_order import order_epoch
from wsm_data.loaders.order.pass_order import SourceLayout

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # after the choice of a backend without a screen

SHARDS, SHARD_CLIPS = 200, 250
CLIPS = SHARDS * SHARD_CLIPS
SCENES, SCENES_PER_SHARD = 500, 40
BATCH, WORLD_SIZE = 64, 8
EPOCHS = 4
FULL = "full permutation"
ORDERS = {
    "in order": OrderConfig(global_batch=BATCH, shuffle=False),
    "whole shards, window of 1": OrderConfig(global_batch=BATCH, window_blocks=1),
    "whole shards, window of 4 (default)": OrderConfig(global_batch=BATCH),
    "whole shards, window of 16": OrderConfig(global_batch=BATCH, window_blocks=16),
    "blocks of 32, window of 8": OrderConfig(global_batch=BATCH, block_clips=32, window_blocks=8),
    "blocks of 8, window of 32": OrderConfig(global_batch=BATCH, block_clips=8, window_blocks=32),
    FULL: OrderConfig(global_batch=BATCH, block_clips=1, window_blocks=1),
}
MEASURES = (
    "pairs kept", "neighbours", "shards", "scenes", "correlation", "shards in 1000", "shards of a node"
)  # fmt: skip


def steps_of(layout: SourceLayout, order: OrderConfig, epoch: int) -> np.ndarray:
    """Clips by step and slot, int64 [steps, batch]."""
    epoch_order = order_epoch([layout], order, epoch)
    return epoch_order.refs[epoch_order.slots].T


def pairs_kept(steps: np.ndarray, before: np.ndarray) -> float:
    step_before = np.full(CLIPS, -1)
    step_before[before] = np.arange(len(before))[:, None]
    own = np.sort(step_before[steps], axis=1)
    kept = sum(int((own[:, shift:] == own[:, :-shift])[own[:, shift:] >= 0].sum()) for shift in range(1, BATCH))
    return kept / (len(steps) * BATCH * (BATCH - 1) / 2 * (BATCH - 1) / (CLIPS - 1))


def neighbours(steps: np.ndarray) -> float:
    found = int((np.diff(np.sort(steps, axis=1), axis=1) == 1).sum())
    return found / (len(steps) * BATCH * (BATCH - 1) / CLIPS)


def different(values: np.ndarray) -> float:
    """Mean number of different values in a row."""
    return float((np.diff(np.sort(values, axis=1), axis=1) != 0).sum(axis=1).mean() + 1)


def measure(steps: np.ndarray, before: np.ndarray, scene_of: np.ndarray) -> dict[str, float]:
    shards = steps // SHARD_CLIPS
    share = BATCH // WORLD_SIZE
    by_rank = shards.reshape(len(steps), WORLD_SIZE, share).transpose(1, 0, 2).reshape(WORLD_SIZE, -1)
    stretches = by_rank[:, : by_rank.shape[1] // 1000 * 1000].reshape(-1, 1000)
    place = np.sort(steps.ravel())
    step_of = np.argsort(steps.ravel(), kind="stable") // BATCH
    return {
        "pairs kept": pairs_kept(steps, before),
        "neighbours": neighbours(steps),
        "shards": different(shards),
        "scenes": different(scene_of[steps]),
        "correlation": abs(float(np.corrcoef(place, step_of)[0, 1])),
        "shards in 1000": different(stretches),
        "shards of a node": different(by_rank) / (SHARDS / WORLD_SIZE),
    }


def measure_orders() -> tuple[dict[str, dict[str, float]], dict[str, np.ndarray]]:
    """Means over the epochs by order, and the first epoch of each."""
    rng = np.random.default_rng(0)
    scenes = np.concatenate([rng.choice(rng.choice(SCENES, SCENES_PER_SHARD), SHARD_CLIPS) for _ in range(SHARDS)])
    layout = SourceLayout(shard_clips=np.full(SHARDS, SHARD_CLIPS), latents=np.ones(CLIPS, np.int32))
    found, firsts = {}, {}
    for name, order in ORDERS.items():
        epochs = [steps_of(layout, order, epoch) for epoch in range(EPOCHS + 1)]
        runs = [measure(after, before, scenes) for before, after in pairwise(epochs)]
        found[name] = {what: float(np.mean([run[what] for run in runs])) for what in MEASURES}
        firsts[name] = epochs[0]
    for what in ("shards", "scenes"):
        most = found[FULL][what]
        for one in found.values():
            one[what] /= most
    return found, firsts


def draw(firsts: dict[str, np.ndarray]) -> None:
    """Where in storage the steps read: a point for each clip of every fourth step, a colour for each rank."""
    figure, axes = plt.subplots(1, len(firsts), figsize=(3 * len(firsts), 3.4), sharey=True, layout="constrained")
    for axis, (name, steps) in zip(axes, firsts.items(), strict=True):
        steps = steps[::4]
        rank = np.broadcast_to(np.arange(BATCH) // (BATCH // WORLD_SIZE), steps.shape)
        step = np.broadcast_to(np.arange(len(steps))[:, None], steps.shape)
        axis.scatter(4 * step, steps / SHARD_CLIPS, c=rank, s=0.4, cmap="tab10", vmin=0, vmax=9, rasterized=True)
        axis.set(title=name, xlabel="step", xlim=(0, 4 * len(steps)), ylim=(0, SHARDS))
        axis.title.set_fontsize(8)
    axes[0].set_ylabel("shard")
    figure.savefig(RESULTS / "shuffle.png", dpi=64)


def main() -> None:
    found, firsts = measure_orders()
    about = machine("numpy")
    rows = [[name, *(f"{found[name][what]:.3g}" for what in MEASURES)] for name in ORDERS]
    lines = ["# Quality of the shuffle", "", *__doc__.splitlines()[2:], ""]
    lines += [f"Global batch {BATCH}, {WORLD_SIZE} ranks, {CLIPS:,} clips. {machine_line(about)}", ""]
    lines += [*table(["order", *MEASURES], rows), "", "![Where in storage the steps read](shuffle.png)"]
    write_results("shuffle", {"machine": about, "clips": CLIPS, "global_batch": BATCH, "orders": found}, lines)
    draw(firsts)


if __name__ == "__main__":
    main()
