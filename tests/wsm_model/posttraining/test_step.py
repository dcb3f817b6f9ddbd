import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from wsm_model.inference.session import SessionConfig
from wsm_model.posttraining.adapters import AdaptedModel
from wsm_model.posttraining.advantages import Spread
from wsm_model.posttraining.config import AdapterConfig, PosttrainingConfig
from wsm_model.posttraining.objective import ObjectiveConfig
from wsm_model.posttraining.step import posttraining_step, roll_out_all
from wsm_model.training.loop import TrainingRun

CONFIG = PosttrainingConfig(
    group=3,
    flow_steps=2,
    objective=ObjectiveConfig(flow_times=2),
    adapters=AdapterConfig(rank=2, alpha=4),
    session=SessionConfig(chunk_size=2),
)


def start(make_model):
    torch.manual_seed(3)
    adapted = AdaptedModel(make_model(), CONFIG.adapters)
    run = TrainingRun(
        model=adapted.kept,
        optimiser=torch.optim.AdamW(adapted.trained(), lr=1e-2, weight_decay=0.0),
        folder=Path("none"),
        identity={},
    )
    return adapted, run


def weights(adapted):
    return {name: one.detach().clone() for name, one in adapted.kept.named_parameters()}


def test_a_step_changes_the_trained_adapter_alone(make_model, make_query):
    adapted, run = start(make_model)
    frozen = {name: one.clone() for name, one in adapted.model.named_parameters() if "lora_" not in name}
    before = weights(adapted)
    rolled = roll_out_all(adapted, [make_query(0), make_query(1)], CONFIG, epoch=0)
    result = posttraining_step(adapted, run, CONFIG, rolled, epoch=0)
    after = weights(adapted)
    changed = {name for name in before if not torch.equal(before[name], after[name])}
    assert changed == {name for name in before if "lora_B/default" in name}  # the first gradient of A is 0: B is 0
    assert all(torch.equal(one, dict(adapted.model.named_parameters())[name]) for name, one in frozen.items())
    assert np.isfinite(list(result.losses.values())).all()
    assert set(result.losses) >= {"loss", "reward", "unsafe_share", "reward_spread", "skipped_share"}


def test_queries_count_the_same_in_whatever_order_they_come(make_model, make_query):
    found = []
    for numbers in ((0, 1), (1, 0)):
        adapted, run = start(make_model)
        rolled = roll_out_all(adapted, [make_query(number) for number in numbers], CONFIG, epoch=0)
        posttraining_step(adapted, run, CONFIG, rolled, epoch=0)
        found.append(weights(adapted))
    for name in found[0]:
        torch.testing.assert_close(found[0][name], found[1][name], atol=1e-5, rtol=1e-5)


def test_a_group_without_a_safe_dream_is_skipped(make_model, make_query):
    adapted, run = start(make_model)
    query = make_query(0)
    occupied = replace(query.reward_map.grid, cells=np.ones_like(query.reward_map.grid.cells))
    walled = replace(query, reward_map=replace(query.reward_map, grid=occupied))
    before = weights(adapted)
    result = posttraining_step(adapted, run, CONFIG, roll_out_all(adapted, [walled], CONFIG, epoch=0), epoch=0)
    assert result.losses["skipped_share"] == 1.0
    assert result.losses["unsafe_share"] == 1.0
    after = weights(adapted)
    assert all(torch.equal(after[name], before[name]) for name in before)


def test_rewards_may_be_divided_by_the_spread_of_the_step(make_model, make_query):
    adapted, run = start(make_model)
    config = replace(CONFIG, spread=Spread.STEP)
    rolled = roll_out_all(adapted, [make_query(0), make_query(1)], config, epoch=0)
    assert np.isfinite(posttraining_step(adapted, run, config, rolled, epoch=0).losses["loss"])


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_two_processes_equal_one(make_model, make_query, tmp_path):
    """Within 1e-5: gradients are added in another order."""
    adapted, run = start(make_model)
    rolled = roll_out_all(adapted, [make_query(0), make_query(1)], CONFIG, epoch=0)
    posttraining_step(adapted, run, CONFIG, rolled, epoch=0)
    children = []
    for rank in range(2):
        child = os.fork()
        if not child:
            code = 1
            try:
                torch.distributed.init_process_group(
                    "gloo", init_method=f"file://{tmp_path}/group", rank=rank, world_size=2
                )
                own, own_run = start(make_model)
                mine = roll_out_all(own, [make_query(rank)], CONFIG, epoch=0)
                posttraining_step(own, own_run, CONFIG, mine, epoch=0)
                torch.save(weights(own), tmp_path / f"{rank}.pt")
                torch.distributed.barrier()
                torch.distributed.destroy_process_group()
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    assert [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children] == [0, 0]
    for rank in range(2):
        found = torch.load(tmp_path / f"{rank}.pt", weights_only=True)
        for name, expected in weights(adapted).items():
            torch.testing.assert_close(found[name], expected, atol=1e-5, rtol=1e-5)
