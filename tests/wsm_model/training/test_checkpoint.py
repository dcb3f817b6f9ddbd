"""Checkpoints: what comes back, what is passed over, what is refused."""

import errno
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file
from torch.distributed.checkpoint.hf_storage import HuggingFaceStorageWriter

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import xxh3_128_file
from wsm_model.training.checkpoint import (
    TrainingState,
    checkpoints,
    drop_old_checkpoints,
    load_checkpoint,
    read_state,
    save_checkpoint,
)
from wsm_model.training.config import OptimiserConfig
from wsm_model.training.schedule import make_optimiser

IDENTITY = {"model.size": "small", "training.seed": 0}
LOADER = {"epoch": 2, "step": 31, "sources": [{"release": "abc", "weight": 0.1}]}


@pytest.fixture
def make_run(make_model) -> Callable[..., SimpleNamespace]:
    """Builds model and optimiser, after some steps of random gradients."""

    def make(steps: int = 0) -> SimpleNamespace:
        model = make_model(layers=1)
        optimiser = make_optimiser(model, OptimiserConfig())
        generator = torch.Generator().manual_seed(steps)
        for _ in range(steps):
            for parameter in model.parameters():
                parameter.grad = torch.randn(parameter.shape, generator=generator)
            optimiser.step()
        return SimpleNamespace(model=model, optimiser=optimiser)

    return make


@pytest.fixture
def saved(make_run, tmp_path) -> SimpleNamespace:
    """A run of three steps, its checkpoint, and the file of its tensors."""
    run = make_run(3)
    path = save_checkpoint(tmp_path, run.model, run.optimiser, state_of(3))
    (tensors,) = path.glob("*.safetensors")
    return SimpleNamespace(model=run.model, optimiser=run.optimiser, folder=tmp_path, path=path, tensors=tensors)


def state_of(step: int) -> TrainingState:
    return TrainingState(step=step, loader=LOADER, identity=IDENTITY)


def test_weights_moments_and_state_come_back_to_the_bit(saved, make_run):
    run = make_run()
    assert load_checkpoint(saved.path, run.model, run.optimiser, IDENTITY) == state_of(3)
    pairs = list(zip(saved.model.parameters(), run.model.parameters(), strict=True))
    for wanted, found in pairs:
        assert torch.equal(found, wanted)
        before, after = saved.optimiser.state[wanted], run.optimiser.state[found]
        assert set(after) == set(before) == {"step", "exp_avg", "exp_avg_sq"}
        assert all(torch.equal(after[name], before[name]) for name in before)


def test_the_next_step_of_a_loaded_run_is_that_of_the_run_which_went_on(saved, make_run):
    loaded = make_run()
    load_checkpoint(saved.path, loaded.model, loaded.optimiser, IDENTITY)
    for run in (saved, loaded):
        generator = torch.Generator().manual_seed(9)
        for parameter in run.model.parameters():
            parameter.grad = torch.randn(parameter.shape, generator=generator)
        run.optimiser.step()
    for wanted, found in zip(saved.model.parameters(), loaded.model.parameters(), strict=True):
        assert torch.equal(found, wanted)


def test_a_checkpoint_before_the_first_step_has_no_moments_and_comes_back(make_run, tmp_path):
    first, other = make_run(), make_run(2)
    path = save_checkpoint(tmp_path, first.model, first.optimiser, state_of(0))
    load_checkpoint(path, other.model, other.optimiser, IDENTITY)
    for wanted, found in zip(first.model.parameters(), other.model.parameters(), strict=True):
        assert torch.equal(found, wanted)
        assert other.optimiser.state[found] == {}


def test_a_folder_without_its_state_is_unfinished_and_passed_over(saved):
    unfinished = saved.folder / "step-000004"
    unfinished.mkdir()
    (unfinished / saved.tensors.name).write_bytes(saved.tensors.read_bytes())
    (saved.folder / "step-000005.partial").mkdir()
    (saved.folder / "notes").mkdir()
    assert checkpoints(saved.folder) == [saved.path]
    assert checkpoints(saved.folder / "nowhere") == []


def test_what_a_killed_run_left_is_written_anew(saved, make_run):
    left = saved.folder / "step-000004"
    left.mkdir()
    (left / "shard-00009-model-00009-of-00009.safetensors").write_bytes(b"half a file")
    run = make_run(4)
    assert save_checkpoint(saved.folder, run.model, run.optimiser, state_of(4)) == left
    loaded = make_run()
    assert load_checkpoint(left, loaded.model, loaded.optimiser, IDENTITY).step == 4


def test_the_state_is_written_after_all_tensors(make_run, tmp_path, monkeypatch):
    """A failure between the two leaves a folder that is passed over."""

    def fail(*_: object) -> None:
        raise OSError("disk full")

    run = make_run(1)
    monkeypatch.setattr("wsm_model.training.checkpoint.write_text", fail)
    with pytest.raises(OSError, match="disk full"):
        save_checkpoint(tmp_path, run.model, run.optimiser, state_of(1))
    assert list((tmp_path / "step-000001").glob("*.safetensors"))
    assert checkpoints(tmp_path) == []


def cut_tail(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def cut_header(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:100])


def spoil_header(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[20] ^= 0xFF
    path.write_bytes(data)


def drop_tensor(path: Path) -> None:
    """The tensor goes, the file stays whole."""
    with safe_open(path, framework="pt") as file:
        about = file.metadata()
    tensors = load_file(path)
    del tensors["model.goal.linear_1.bias"]
    save_file(tensors, path, metadata=about)


def drop_tensor_and_vouch_for_it(path: Path) -> None:
    drop_tensor(path)
    (digests,) = path.parent.glob("digests-*.json")
    digests.write_text(json.dumps({path.name: xxh3_128_file(path)}))


def flip_a_byte_of_a_tensor(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-5] ^= 1
    path.write_bytes(data)


def drop_digests(path: Path) -> None:
    for file in path.parent.glob("digests-*.json"):
        file.unlink()


CHANGED = "does not have the digest that was written with it"


@pytest.mark.parametrize(
    ("damage", "cause"),
    [
        (cut_tail, CHANGED),
        (cut_header, CHANGED),
        (spoil_header, CHANGED),
        (flip_a_byte_of_a_tensor, CHANGED),
        (drop_tensor, CHANGED),
        (drop_tensor_and_vouch_for_it, r"Missing key in checkpoint state_dict: model\.goal\.linear_1\.bias"),
        (Path.unlink, "No such file or directory"),
        (drop_digests, "there is no digest of .*safetensors"),
    ],
)
def test_damaged_tensors_are_refused_in_one_line_that_names_folder_and_cause(saved, make_run, damage, cause):
    damage(saved.tensors)
    run = make_run()
    wanted = rf"step-000003 must be a whole checkpoint, but: .*{cause}.*; delete it to go on from the one before"
    with pytest.raises(IntegrityError, match=wanted) as caught:
        load_checkpoint(saved.path, run.model, run.optimiser, IDENTITY)
    assert "Traceback" not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "[]", '{"step": 3}', '{"step": "x", "loader": {}, "identity": {}}'])
def test_a_damaged_state_is_refused(saved, text):
    (saved.path / "state.json").write_text(text)
    with pytest.raises(IntegrityError, match=r"state\.json must be the state of a checkpoint"):
        read_state(saved.path)


def test_another_run_is_refused_with_every_field_that_differs_and_fills_nothing(saved, make_run):
    run = make_run()
    before = [parameter.detach().clone() for parameter in run.model.parameters()]
    other = {"model.size": "tiny", "training.seed": 0, "training.loss.depth": 2.0}
    with pytest.raises(ConfigError) as caught:
        load_checkpoint(saved.path, run.model, run.optimiser, other)
    assert str(caught.value).splitlines() == [
        f"{saved.path} belongs to another run; give another --out, or the same settings:",
        '  model.size: "small" -> "tiny"',
        "  training.loss.depth: absent -> 2.0",
    ]
    for wanted, found in zip(before, run.model.parameters(), strict=True):
        assert torch.equal(found, wanted)


def test_all_but_the_latest_are_dropped_in_the_order_of_steps(make_run, tmp_path):
    for step in (999_999, 5, 1_000_000, 40):  # seven digits come after six, whatever their first one
        path = tmp_path / f"step-{step:06d}"
        path.mkdir()
        (path / "state.json").write_text(json.dumps({"step": step}))
    drop_old_checkpoints(tmp_path, 2)
    assert [path.name for path in checkpoints(tmp_path)] == ["step-999999", "step-1000000"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["step-1000000", "step-999999"]


@pytest.mark.parametrize("cause", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
def test_what_ends_the_writing_is_raised_as_it_is_and_leaves_no_checkpoint(make_run, tmp_path, monkeypatch, cause):
    """torch wraps whatever happens on a rank, Ctrl-C included, in an exception with a traceback of its own."""

    def end(*_):
        raise cause

    monkeypatch.setattr(HuggingFaceStorageWriter, "write_data", end)
    run = make_run(1)
    with pytest.raises(type(cause)) as raised:
        save_checkpoint(tmp_path, run.model, run.optimiser, state_of(1))
    assert raised.value is cause
    assert checkpoints(tmp_path) == []
