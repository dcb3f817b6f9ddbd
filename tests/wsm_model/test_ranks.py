"""Two processes beside one: weights, losses, checkpoints, and what is sent among them."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
import torch.distributed as dist

from wsm_data.errors import ConfigError
from wsm_data.schema.sequence import SequenceSpan
from wsm_model.model import Attention, WorldSlamModel
from wsm_model.precision import Precision
from wsm_model.ranks import build_model, gather_text, put_share, rank_mesh, whole, whole_model
from wsm_model.training.average import averaged, follow, start_average
from wsm_model.training.checkpoint import TrainingState, load_checkpoint, save_checkpoint
from wsm_model.training.config import OptimiserConfig, TrainingConfig
from wsm_model.training.loop import TrainingRun
from wsm_model.training.pretraining import pretraining_step
from wsm_model.training.schedule import make_optimiser

CPU = torch.device("cpu")


def on_two_ranks(folder: Path, act: Callable[[int], object]) -> list[object]:
    """What each of two forked processes of a gloo group answers, as JSON."""
    children = []
    for rank in range(2):
        child = os.fork()
        if not child:
            code = 1
            try:
                dist.init_process_group("gloo", init_method=f"file://{folder}/group", rank=rank, world_size=2)
                (folder / f"answer-{rank}.json").write_text(json.dumps(act(rank)))
                dist.barrier()
                dist.destroy_process_group()
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    assert [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children] == [0, 0]
    return [json.loads((folder / f"answer-{rank}.json").read_text()) for rank in range(2)]


def half_of(batch: SimpleNamespace, rank: int) -> SimpleNamespace:
    """Two of the four rows of a batch, counted from the first."""
    rows = slice(2 * rank, 2 * rank + 2)
    return SimpleNamespace(
        rgb=batch.rgb[rows],
        depth=batch.depth[rows],
        poses=batch.poses[rows],
        spans=tuple(replace(span, row=span.row - rows.start) for span in batch.spans[rows]),
        goal_camera0_m=batch.goal_camera0_m[rows],
        refs=batch.refs[rows],
        keys=batch.keys[rows],
        epoch=batch.epoch,
        step=batch.step,
    )


@pytest.fixture
def batch(make_poses) -> SimpleNamespace:
    generator = torch.Generator().manual_seed(3)
    latents = (4, 4, 6, 4, 6)
    return SimpleNamespace(
        rgb=torch.randn(latents, generator=generator),
        depth=torch.randn(latents, generator=generator),
        poses=make_poses(4, 4, 4, generator=generator),
        spans=tuple(SequenceSpan(row=row, start=0, length=4, chunk_size=1 + row % 2) for row in range(4)),
        goal_camera0_m=torch.randn(4, 3, generator=generator),
        refs=list(range(4)),
        keys=tuple("abcd"),
        epoch=0,
        step=0,
    )


def stepped(config, precision: Precision, batch: SimpleNamespace, shard_ranks: int = 0):
    """A model after a plain gradient step of rate 0.1, recomputed in two parts, and the losses of that step."""
    torch.manual_seed(0)
    model = build_model(config, Attention.BLOCKS, CPU, precision=precision, shard_ranks=shard_ranks)
    model.checkpoint_activations = True
    optimiser = torch.optim.SGD(model.parameters(), lr=0.1)
    run = TrainingRun(model=model, optimiser=optimiser, folder=Path(), identity={})
    result = pretraining_step(model, run, TrainingConfig(precision=precision, micro_rows=1), batch)
    return model, result


@pytest.mark.parametrize(
    ("precision", "shard_ranks", "tolerance"),
    [(Precision.FLOAT32, 0, 1e-6), (Precision.FLOAT32, 1, 1e-6), (Precision.BFLOAT16, 0, 1e-4)],
)
def test_two_ranks_take_the_step_that_one_takes(config, batch, tmp_path, precision, shard_ranks, tolerance):
    """A step is at most 0.2 long, by a gradient clipped at 2; gradients agree to the rounding of sums or bfloat16."""
    alone, wanted = stepped(config, precision, batch)
    flat = torch.cat([one.detach().flatten() for one in alone.parameters()])

    def act(rank: int) -> object:
        model, result = stepped(config, precision, half_of(batch, rank), shard_ranks)
        found = torch.cat([whole(one.detach()).flatten() for one in model.parameters()])
        work = result.work
        own = sum(one.to_local().numel() for one in model.parameters())
        return {
            "far": float((found - flat).abs().max()),
            "losses": dict(result.losses),
            "latents": work.latents,
            "own": own,
        }

    for answer in on_two_ranks(tmp_path, act):
        assert answer["far"] < tolerance
        assert answer["losses"] == pytest.approx(dict(wanted.losses), rel=1e-5 if tolerance < 1e-5 else 1e-2)
        assert answer["latents"] == 16
        share = flat.numel() if shard_ranks == 1 else 0.6 * flat.numel()
        assert answer["own"] <= share


def test_random_weights_are_those_of_one_process_and_a_whole_copy_speaks_for_them(
    config, make_inputs, make_spans, tmp_path
):
    torch.manual_seed(0)
    alone = WorldSlamModel(config, Attention.BLOCKS).eval()
    inputs = make_inputs(make_spans([4], [1]))
    with torch.no_grad():
        velocity = alone(inputs).velocity

    def act(rank: int) -> object:
        torch.manual_seed(0)
        model = build_model(config, Attention.BLOCKS, CPU, precision=Precision.BFLOAT16)
        same = [
            torch.equal(whole(one), wanted) for one, wanted in zip(model.parameters(), alone.parameters(), strict=True)
        ]
        heard = gather_text(f"rank {rank}")
        if rank:  # without the other: nothing is gathered any more
            with whole_model_of(model) as copied, torch.no_grad():
                return [all(same), heard, bool(torch.equal(copied(inputs).velocity, velocity))]
        with whole_model_of(model):
            return [all(same), heard, True]

    whole_model_of = whole_model
    assert on_two_ranks(tmp_path, act) == [[True, ["rank 0", "rank 1"], True]] * 2


def test_the_first_rank_hands_out_what_it_alone_has_read(config, tmp_path):
    def act(rank: int) -> object:
        model = build_model(config, Attention.BLOCKS, CPU, precision=Precision.FLOAT32)
        parameter = model.goal.linear_2.weight
        values = torch.arange(parameter.numel(), dtype=torch.float32).view(parameter.shape)
        put_share(parameter, values if rank == 0 else torch.zeros_like(values), is_everywhere=False)
        return bool(torch.equal(whole(parameter.detach()), values))

    assert on_two_ranks(tmp_path, act) == [True, True]


def test_a_checkpoint_of_two_ranks_with_its_average_is_read_by_one(config, batch, tmp_path):
    state = TrainingState(step=1, loader={}, identity={})

    def act(rank: int) -> object:
        model, _ = stepped(config, Precision.FLOAT32, half_of(batch, rank))
        average = start_average(model, 0.9)
        for parameter in model.parameters():
            parameter.detach().add_(1.0)
        follow(average, model, 1)
        save_checkpoint(
            tmp_path, model, make_optimiser(model, OptimiserConfig()), replace(state, step=0), average.weights
        )
        with averaged(model, average):
            return float(sum(whole(one.detach()).double().sum() for one in model.parameters()))

    sums = on_two_ranks(tmp_path, act)
    model = WorldSlamModel(config)
    average = start_average(model, 0.9)
    load_checkpoint(tmp_path / "step-000000", model, make_optimiser(model, OptimiserConfig()), {}, average.weights)
    found = float(sum(one.double().sum() for one in average.weights.values()))
    assert sums == pytest.approx([found, found], rel=1e-6)


def test_ranks_that_do_not_fill_their_rows_are_refused(config, tmp_path):
    def act(_: int) -> object:
        try:
            rank_mesh(CPU, 3)
        except ConfigError as error:
            return str(error)
        return ""

    assert on_two_ranks(tmp_path, act) == ["training.shard_ranks must divide the 2 ranks, found 3"] * 2
