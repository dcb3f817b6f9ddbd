"""The loop: exact resume, parts that add up, and what ends a run."""

from dataclasses import replace

import pytest
import torch

from wsm_data.errors import ConfigError, NumericalError
from wsm_model.training.checkpoint import checkpoints


def weights(model: torch.nn.Module) -> torch.Tensor:
    """All parameters in one vector."""
    return torch.cat([parameter.detach().flatten() for parameter in model.parameters()])


def test_a_run_that_is_killed_and_resumed_ends_in_the_same_bits(run, settings, undisturbed, tmp_path):
    run(tmp_path, settings, kill_after=3)  # after its checkpoint of step 2
    resumed, rest = run(tmp_path, settings)
    assert [line["step"] for line in rest] == [3, 4, 5, 6]
    assert torch.equal(weights(resumed), weights(undisturbed.model))
    assert [line["loss"] for line in rest] == [line["loss"] for line in undisturbed.lines[2:]]


def test_parts_of_a_step_add_up_to_the_step(run, settings, undisturbed, tmp_path):
    parts, lines = run(tmp_path, replace(settings, micro_rows=1))
    whole = undisturbed.lines
    assert lines[0]["loss"] == pytest.approx(whole[0]["loss"], rel=1e-6)  # float32, summed in another order
    torch.testing.assert_close(
        weights(parts), weights(undisturbed.model), rtol=0, atol=1e-4
    )  # a tenth of one step of AdamW


def test_only_the_latest_checkpoints_are_kept(run, settings, tmp_path):
    run(tmp_path, replace(settings, keep_checkpoints=2))
    assert [path.name for path in checkpoints(tmp_path)] == ["step-000004", "step-000006"]


@pytest.mark.parametrize("name", ["rgb", "depth", "poses"])
def test_a_nan_in_a_batch_ends_the_run_and_names_step_clip_and_cause(run, settings, tmp_path, name):
    with pytest.raises(NumericalError) as caught:
        run(tmp_path, settings, spoil={3: name})
    message = str(caught.value)
    assert "epoch 0, step 3" in message
    assert "clip 3/1" in message
    assert f"the batch itself holds NaN or infinity in {name}" in message
    assert [path.name for path in checkpoints(tmp_path)] == ["step-000002"]


def test_a_loss_that_is_not_finite_is_named_by_its_parts(run, settings, tmp_path):
    wild = replace(settings, optimiser=replace(settings.optimiser, learning_rate=1e30, final_learning_rate=1e29))
    with pytest.raises(NumericalError, match=r"found .*flow.* not finite for the clips .*; the batch is finite"):
        run(tmp_path, wild)


def test_checkpoints_of_another_run_are_refused_with_the_difference(run, settings, undisturbed):
    with pytest.raises(ConfigError, match='model: "small" -> "large"'):
        run(undisturbed.folder, settings, identity={"model": "large"})


def test_the_loss_falls_on_batches_seen_again_and_again(run, settings, tmp_path, make_loader, monkeypatch):
    loader_type = type(make_loader())
    first = loader_type._batch
    monkeypatch.setattr(loader_type, "_batch", lambda self, step: first(self, 0))
    optimiser = replace(settings.optimiser, learning_rate=1e-2, final_learning_rate=1e-2, generation_factor=1.0)
    _, lines = run(tmp_path, replace(settings, max_steps=40, checkpoint_every=40, optimiser=optimiser))
    assert lines[-1]["depth"] < 0.8 * lines[0]["depth"]
    assert lines[-1]["pose_absolute"] < 0.8 * lines[0]["pose_absolute"]
