"""Damaged checkpoints of training: refused, or the very tensors and the very state that were saved."""

import random
import shutil

import pytest
import torch
from test_damages import DAMAGES

from wsm_data.errors import WsmError
from wsm_model.training.checkpoint import TrainingState, checkpoints, load_checkpoint, save_checkpoint

IDENTITY = {"model.size": "tiny"}


def trained(seed):
    torch.manual_seed(seed)
    model = torch.nn.Linear(5, 3)
    optimiser = torch.optim.AdamW(model.parameters())
    for _ in range(2):
        model(torch.randn(4, 5)).square().sum().backward()
        optimiser.step()
    return model, optimiser


def tensors(model, optimiser):
    return [*model.parameters(), *(value for one in optimiser.state_dict()["state"].values() for value in one.values())]


@pytest.mark.parametrize("count", [pytest.param(30), pytest.param(150, marks=pytest.mark.slow)])
def test_no_damaged_checkpoint_is_trained_on(count, tmp_path, faults):
    saved = trained(1)
    state = TrainingState(step=2, loader={"epoch": 0, "step": 2}, identity=IDENTITY)
    whole = save_checkpoint(tmp_path / "whole", *saved, state)
    chance = random.Random(count)
    refused = 0
    for number in range(count):
        folder = tmp_path / "damaged"
        path = shutil.copytree(whole, folder / whole.name)
        file = chance.choice(sorted(path.iterdir()))
        file.write_bytes(DAMAGES[number % len(DAMAGES)](file.read_bytes(), chance))
        found = trained(2)
        try:
            loaded = load_checkpoint(checkpoints(folder)[-1], *found, IDENTITY)
        except WsmError:
            refused += 1
        else:
            assert (loaded.step, dict(loaded.loader)) == (2, {"epoch": 0, "step": 2}), f"{file.name}, {number}"
            assert all(map(torch.equal, tensors(*found), tensors(*saved))), f"{file.name}, {number}"
        shutil.rmtree(folder)
    faults["damages of checkpoints"] += count
    assert refused > count / 2
