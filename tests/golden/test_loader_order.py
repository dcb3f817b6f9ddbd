"""The order of clips and their chunk sizes follow from seed, epoch and settings alone, and stay what they were."""

import hashlib
import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.epoch_order import chunk_sizes, order_epoch
from wsm_data.loaders.order.pass_order import SourceLayout
from wsm_data.loaders.sources.queries import draw_replan_latents

GOLDEN = Path(__file__).with_name("loader_order.json")
SOURCES = [
    SourceLayout(shard_clips=np.array([37, 5, 61, 20]), latents=(np.arange(123) * 7 % 23 + 2).astype(np.int32)),
    SourceLayout(shard_clips=np.array([11, 30]), latents=(np.arange(41) * 5 % 17 + 2).astype(np.int32), weight=1.5),
]
SETTINGS = {
    "plain": {},
    "plain, in order, pad": {"shuffle": False, "remainder": "pad"},
    "plain, blocks of 8, repeat": {"block_clips": 8, "window_blocks": 3, "remainder": "repeat"},
    "bucket": {"arrangement": "bucket", "pool": 4},
    "join": {"arrangement": "join", "row_latents": 40, "pool": 16, "max_latents": 20, "remainder": "pad"},
}
CASES = list(product(SETTINGS, (0, 7, (1 << 64) - 1), (1, 2, 8)))


def digest_of_epochs(settings, seed, world_size):
    """What every rank has in every step of three epochs: the refs of each row, and their chunk sizes."""
    order = OrderConfig(seed=seed, global_batch=8, **SETTINGS[settings])
    digest = hashlib.sha256()
    for epoch in range(3):
        epoch_order = order_epoch(SOURCES, order, epoch)
        for step, rank in product(range(epoch_order.steps), range(world_size)):
            for refs in epoch_order.rows(step, rank, world_size):
                row = [refs.tolist(), chunk_sizes(refs, order, epoch).tolist()]
                digest.update(f"{epoch} {step} {rank} {row}\n".encode())
    return digest.hexdigest()


@pytest.mark.parametrize(("settings", "seed", "world_size"), CASES)
def test_the_order_of_an_epoch_is_the_recorded_one(settings, seed, world_size):
    recorded = json.loads(GOLDEN.read_text())["epochs"][f"{settings}, seed {seed}, {world_size} ranks"]
    assert digest_of_epochs(settings, seed, world_size) == recorded


def test_replan_latents_are_the_recorded_ones():
    rows = np.repeat(np.arange(50), 3)
    drawn = draw_replan_latents(rows, np.full(150, 9), seed=3, epoch=2, source=1)
    assert hashlib.sha256(drawn.astype("<i8").tobytes()).hexdigest() == json.loads(GOLDEN.read_text())["replan_latents"]
